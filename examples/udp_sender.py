"""Send skeletons to kinect_bridge as datagrams: here from a recording, in your program from an SDK.

python3 udp_sender.py RECORDING.csv [--sensor NAME] [--host 127.0.0.1] [--port 9870] [--rate 1]

Plain Python: copy it to the machine where the tracker runs. docs/udp.md has every byte.
"""

import argparse
import csv
import json
import socket
import time


def send(sock, to, seq, time_ns, people):
    """One frame; people: {id: joints}, a list or {name: [x, y, z, confidence]}, None if missing."""
    people = [{"id": each, "joints": joints} for each, joints in people.items()]
    frame = {"v": 1, "seq": seq % 2**32, "time_ns": time_ns, "people": people}
    sock.sendto(json.dumps(frame, allow_nan=False).encode(), to)


def recorded_frames(path, sensor):
    """(capture time [ns], people) for each frame of a plain CSV of kinect_bridge.

    With an SDK, this is where its loop goes: wait for a frame, take the device's time stamp, and
    yield the joints of each body in the SDK's own order and unit. On the receiving side,
    joint_map:=azure_kinect (or kinect_v2, nite2, your own file) says what they are.
    """
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    names = [name[:-6] for name in rows[0] if name.endswith("_state")]
    sensor = sensor or rows[0]["sensor"]
    frames = {}
    for row in (row for row in rows if row["sensor"] == sensor):
        people = frames.setdefault(round(float(row["host_time_s"]) * 1e9), {})
        if row["person"]:
            cells = {n: [row[f"{n}_{v}"] for v in ("x", "y", "z", "state")] for n in names}
            people[row["person"]] = {n: [*map(float, c)] for n, c in cells.items() if all(c)}
    yield from sorted(frames.items())


def main():
    """Stream the recording at its own pace."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording")
    parser.add_argument("--sensor", help="the first one, unless given")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", default=9870, type=int)
    parser.add_argument("--rate", type=float, default=1.0, help="times faster than recorded")
    options, sock = parser.parse_args(), socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    began, first = time.monotonic(), None
    for seq, (time_ns, people) in enumerate(recorded_frames(options.recording, options.sensor)):
        first = time_ns if first is None else first
        due = began + (time_ns - first) * 1e-9 / options.rate
        time.sleep(max(0.0, due - time.monotonic()))
        send(sock, (options.host, options.port), seq, time_ns, people)


if __name__ == "__main__":
    main()
