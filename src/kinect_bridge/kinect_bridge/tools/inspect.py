"""``inspect``: summary of a recording of skeletons."""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kinect_bridge.sources.live import MAX_DISTANCE_M
from pose_io.recordings.formats import AUTO, FORMATS, read_recording
from pose_io.recordings.recording import Recording, SensorStream
from pose_io.recordings.timeline import StreamTimeline, make_timeline, order_lines
from pose_node.command_line import add_option, add_path, run_tool

GAP_S = 0.5  # [s] shortest gap or absence that is listed


def describe(recording: Recording) -> dict[str, Any]:
    """Summary of a recording as plain values for JSON; times from its time zero [s]."""
    timelines = [make_timeline(stream) for stream in recording.streams]
    times = [timeline.time_ns for timeline in timelines if len(timeline)]
    duration_ns = max(int(t[-1]) for t in times) - min(int(t[0]) for t in times)
    return {
        "file": recording.source,
        "format": recording.format,
        "comments": list(recording.comments),
        "time_zero_ns": recording.time_zero_ns,
        "duration_s": duration_ns * 1e-9,
        "persons": list(dict.fromkeys(p for stream in recording.streams for p in stream.persons)),
        "sensors": [
            _describe_sensor(stream, timeline, recording.time_zero_ns)
            for stream, timeline in zip(recording.streams, timelines, strict=True)
        ],
    }


def _describe_sensor(
    stream: SensorStream, timeline: StreamTimeline, zero_ns: int
) -> dict[str, Any]:
    intervals_s = np.diff(timeline.time_ns) * 1e-9
    return {
        "name": stream.name,
        "frames": len(timeline),
        "frames_in_file": len(stream),
        **timeline.counts,
        "rows_repeated": stream.rows_repeated,
        "remarks": list(order_lines(stream, timeline)),
        "persons": list(stream.persons),
        "first_s": (int(timeline.time_ns[0]) - zero_ns) * 1e-9 if len(timeline) else None,
        "last_s": (int(timeline.time_ns[-1]) - zero_ns) * 1e-9 if len(timeline) else None,
        "interval_median_s": float(np.median(intervals_s)) if len(intervals_s) else None,
        "gaps": _plain_spans(timeline.gaps(GAP_S), zero_ns),
        "absences": _plain_spans(_absences(stream, timeline), zero_ns),
        "joints": stream.joint_counts(),
        "far": _far(stream),
        "clock": None if timeline.fit is None else timeline.fit.summary(),
    }


def _plain_spans(spans: list[tuple[int, float]], zero_ns: int) -> list[dict[str, float]]:
    return [{"at_s": (at_ns - zero_ns) * 1e-9, "length_s": length_s} for at_ns, length_s in spans]


def _absences(stream: SensorStream, timeline: StreamTimeline) -> list[tuple[int, float]]:
    """When frames showed nobody for long: the time of the first one [ns] and the length [s]."""
    is_empty = np.diff(stream.row_start)[timeline.frame] == 0
    edges = np.flatnonzero(np.diff(np.concatenate([[False], is_empty, [False]])))
    if not len(edges):
        return []
    ends = np.minimum(edges[1::2], len(timeline) - 1)
    spans = zip(timeline.time_ns[edges[::2]].tolist(), timeline.time_ns[ends].tolist(), strict=True)
    found = [(begin_ns, (end_ns - begin_ns) * 1e-9) for begin_ns, end_ns in spans]
    return [(at_ns, length_s) for at_ns, length_s in found if length_s > GAP_S]


def _far(stream: SensorStream) -> dict[str, float]:
    """Number of joints farther than :data:`MAX_DISTANCE_M`, and the largest distance [m]."""
    far = np.abs(np.nan_to_num(stream.positions, nan=0.0)).max(axis=-1, initial=0.0)
    return {
        "joints": int(np.count_nonzero(far > MAX_DISTANCE_M)),
        "farthest_m": float(far.max(initial=0.0)),
    }


def as_text(description: dict[str, Any]) -> str:
    """The description as text."""
    lines = [
        f"{description['file']}: format {description['format']}, "
        f"{description['duration_s']:.1f} s, {len(description['sensors'])} sensor(s), "
        f"person(s) {', '.join(description['persons']) or 'none'}",
        *(f"  # {comment}" for comment in description["comments"]),
    ]
    for index, sensor in enumerate(description["sensors"]):
        joints, clock = sensor["joints"], sensor["clock"]
        interval_s = sensor["interval_median_s"]
        rate = "" if not interval_s else f", {1 / interval_s:.1f} Hz"
        lines += [
            f"sensor {index}: {sensor['name']}",
            f"  frames   {sensor['frames']} of {sensor['frames_in_file']}{rate}; "
            f"repeated {sensor['frames_repeated']}, out of order "
            f"{sensor['frames_out_of_order']}, put back in order {sensor['frames_reordered']}",
            *(f"  ORDER    {each.partition(': ')[2]}" for each in sensor["remarks"]),
            f"  persons  {', '.join(sensor['persons']) or 'none'}",
            f"  joints   tracked {joints['tracked']}, inferred {joints['inferred']}, "
            f"not tracked {joints['not_tracked']}",
            *_far_lines(sensor["far"]),
            f"  gaps     {_gaps_text(sensor['gaps'])}",
            f"  nobody   {_gaps_text(sensor['absences'])}",
            f"  clock    {_clock_text(clock)}",
        ]
    return "\n".join(lines)


def _far_lines(far: dict[str, float]) -> list[str]:
    if not far["joints"]:
        return []
    return [
        f"  ABSURD   {far['joints']} joints are more than {MAX_DISTANCE_M:g} m away, the farthest"
        f" {far['farthest_m']:.3g} m: is the file damaged, or in other units than metres?"
    ]


def _gaps_text(gaps: Sequence[dict[str, float]]) -> str:
    if not gaps:
        return f"none longer than {GAP_S} s"
    return ", ".join(f"{gap['length_s']:.1f} s at {gap['at_s']:.1f} s" for gap in gaps)


def _clock_text(clock: dict[str, Any] | None) -> str:
    if clock is None:
        return "the host's alone"
    return (
        f"the sensor's own, epochs {clock['clock_epochs']}, drift {clock['clock_drift_ppm']} ppm; "
        f"delay to the host: median {clock['clock_delay_median_ms']} ms, "
        f"95 % {clock['clock_delay_95_ms']} ms, at most {clock['clock_delay_max_ms']} ms"
    )


def _run() -> None:
    parser = argparse.ArgumentParser(
        prog="inspect", description="Summarise a recording of skeletons, and draw its first frame."
    )
    parser.add_argument("file", type=Path, help="the recording, plain or gzip; or a folder")
    parser.add_argument("--json", action="store_true", help="print JSON, without a picture")
    parser.add_argument("--print-only", action="store_true", help="draw nothing")
    picture = "the picture of the first frame (default: <recording>.png in this folder)"
    add_path(parser, "--figure", "PNG", picture)
    add_option(parser, "--format", AUTO, "how to read it", choices=(AUTO, *FORMATS))
    options = parser.parse_args()
    recording = read_recording(options.file, options.format)
    description = describe(recording)
    if options.json:
        print(json.dumps(description, indent=2))
        return
    print(as_text(description))
    if not options.print_only:
        # Imported here: matplotlib takes half a second to load.
        from kinect_bridge.tools.first_frame import draw_first_frames

        figure = options.figure or Path(f"{options.file.resolve().name.split('.')[0]}.png")
        draw_first_frames(recording, figure)
        print(f"first frame: {figure}")


def main() -> None:
    """Run the tool."""
    run_tool(_run)
