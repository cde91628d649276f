"""Datagrams: accepted ones, and rejected ones by reason."""

import json
import socket
import subprocess
import sys
import time
from pathlib import Path

import msgspec
import numpy as np
import pytest
from patience import PATIENCE_S, wait_until

from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.sources.udp import UdpSource
from pose_core.errors import InputError, ParameterError
from pose_core.joints import JOINT_INDEX, JOINTS

ROOT = Path(__file__).parents[3]
CSV = ROOT / "tests" / "kinect_bridge" / "data" / "two_sensors.csv"
SENDER = ("127.0.0.1", 40000)
MS = 1_000_000  # [ns]


@pytest.fixture
def udp():
    """Make a source on a free port."""
    made = []

    def make(**parameters) -> UdpSource:
        values = {"source": "udp", "udp_port": 0, **parameters}
        made.append(UdpSource(KinectBridgeParameters(**values)))
        return made[-1]

    yield make
    for source in made:
        source.close()


def frame(seq: int = 1, joints=None, **values) -> dict:
    person = {"id": "anna", "joints": joints or [[0.1, -0.2, 2.0 + i, 2] for i in range(15)]}
    return {"v": 1, "seq": seq, "time_ns": 1_000 * MS + seq * 33 * MS, "people": [person], **values}


def port_of(source: UdpSource) -> int:
    return int(source.hardware_id.rpartition(":")[2])


def hear(source: UdpSource, datagram, sender=SENDER, encode=json.dumps):
    data = datagram if isinstance(datagram, bytes) else encode(datagram)
    source.hear(data.encode() if isinstance(data, str) else data, sender)
    return source.take()


@pytest.mark.parametrize("encode", [json.dumps, msgspec.msgpack.encode])
def test_a_person_arrives_in_both_encodings(udp, encode):
    found = hear(udp(), frame(), encode=encode)

    assert found.person == ("anna",)
    np.testing.assert_allclose(found.positions[0, :, 2], 2.0 + np.arange(15))
    assert (found.tracking_state == 2).all()


def test_joints_may_be_named_missing_or_without_confidence(udp):
    joints = {"head": [0.0, -0.6, 2.5], "neck": None, "left_hand": [None, 0.0, 1.0]}

    found = hear(udp(), frame(joints=joints))

    assert found.tracking_state[0, JOINT_INDEX["head"]] == 2
    assert found.tracking_state[0].sum() == 2
    assert np.isnan(found.positions[0, JOINT_INDEX["left_hand"]]).all()


def test_another_sdk_s_joints_are_mapped(udp):
    joints = [[10.0 * i, 20.0, 3000.0, 2] for i in range(32)]

    found = hear(udp(joint_map="azure_kinect"), frame(joints=joints))

    np.testing.assert_allclose(
        found.positions[0, JOINT_INDEX["left_elbow"]], [0.06, 0.02, 3.0], atol=1e-12
    )


def test_a_datagram_without_persons_is_a_frame(udp):
    assert hear(udp(), frame(people=[])).person == ()


@pytest.mark.parametrize(
    ("datagram", "reason"),
    [
        (b"", "datagrams_malformed"),
        (b"hello", "datagrams_malformed"),
        (b"{", "datagrams_malformed"),
        (b"\xff\xfe", "datagrams_malformed"),
        (b'{"v":1}', "datagrams_malformed"),
        (json.dumps(frame()).encode().replace(b"anna", b"ann\xff"), "datagrams_malformed"),
        (b"[" * 20_000, "datagrams_malformed"),
        (b"\x91" * 20_000, "datagrams_malformed"),
        (b'{"v":1,"seq":1,"time_ns":1,"people":[],"x":' + b"[" * 20_000, "datagrams_malformed"),
        (json.dumps(frame(seq=2**32)).encode(), "datagrams_malformed"),
        (json.dumps(frame(time_ns=-1)).encode(), "datagrams_malformed"),
        (json.dumps(frame(joints=[[1.0, 2.0]])).encode(), "datagrams_malformed"),
        (json.dumps(frame(joints=[[0.0, 0.0, 1.0]] * 200)).encode(), "datagrams_malformed"),
        (json.dumps(frame(v=2)).encode(), "datagrams_other_version"),
        (json.dumps(frame(joints={"tail": [0, 0, 0]})).encode(), "datagrams_wrong_joints"),
        (b" " * 40_000, "datagrams_too_long"),
    ],
)
def test_invalid_datagrams_are_counted_by_reason_and_have_no_effect(udp, datagram, reason):
    source = udp()

    assert hear(source, datagram) is None
    assert source.counters[reason] == 1
    assert hear(source, frame()).person == ("anna",)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e300])
def test_places_that_are_no_places_are_missing(udp, value):
    joints = [[value, 0.0, 2.0, 2]] + [[0.0, 0.0, 2.0, 2]] * 14

    found = hear(udp(), frame(joints=joints), encode=msgspec.msgpack.encode)

    assert found.tracking_state[0].tolist() == [0] + [2] * 14
    assert np.isnan(found.positions[0, 0]).all()


@pytest.mark.parametrize(
    ("people", "reason", "left"),
    [
        ([{"id": "a/b", "joints": [[0, 0, 1]] * 15}], "people_bad_id", 0),
        ([{"id": "a", "joints": [[0, 0, 1]] * 14}], "people_wrong_joints", 0),
        ([{"id": "a", "joints": [None] * 15}], "people_without_joints", 0),
        ([{"id": "a", "joints": [[0, 0, 1]] * 15}] * 2, "people_repeated", 1),
        ([{"id": i, "joints": [[0, 0, 1]] * 15} for i in range(17)], "people_beyond_limit", 16),
    ],
)
def test_people_that_cannot_be_are_left_out_and_counted(udp, people, reason, left):
    source = udp()

    assert len(hear(source, frame(people=people)).person) == left
    assert source.counters[reason] == 1


def test_lost_late_and_repeated_datagrams_are_counted_and_a_wrap_is_none_of_them(udp):
    source = udp()
    first = 2**32 - 3

    for number in (first, first + 1, first + 1, 1, 0):
        hear(source, frame(seq=number % 2**32, time_ns=MS * ((number - first) % 2**32 + 1)))

    assert source.counters["frames_lost"] == 2
    assert source.counters["datagrams_late"] == 2
    assert source.counters["frames_received"] == 3


def test_a_restarted_sender_is_accepted_again(udp):
    source = udp()
    hear(source, frame(seq=50_000))

    assert hear(source, frame(seq=0, time_ns=5)) is not None
    assert source.counters["sender_restarts"] == 1


def test_only_named_addresses_may_send(udp):
    source = udp(udp_senders="192.168.1.20, ::1")

    assert hear(source, frame(), sender=("192.168.1.21", 1)) is None
    assert hear(source, frame(), sender=("192.168.1.20", 1)) is not None
    assert source.counters["datagrams_foreign_sender"] == 1


def test_a_second_sender_is_not_mixed_in(udp):
    source = udp()
    source._now_ns = lambda: 10**18
    hear(source, frame(1))

    assert hear(source, frame(2), sender=("127.0.0.1", 1)) is None
    assert source.counters["datagrams_second_sender"] == 1
    source._now_ns = lambda: 10**18 + 3 * 10**9
    assert hear(source, frame(3), sender=("127.0.0.1", 1)) is not None


def test_an_open_address_needs_named_senders(udp):
    with pytest.raises(ParameterError, match="name the ones that may send in udp_senders"):
        udp(udp_address="0.0.0.0")


def test_addresses_that_are_none_are_refused(udp):
    with pytest.raises(ParameterError, match="'localhost' is not an IP address"):
        udp(udp_address="localhost")


def test_a_port_in_use_is_reported(udp):
    port = port_of(udp())
    with pytest.raises(InputError, match=f"cannot listen on 127.0.0.1 port {port}"):
        udp(udp_port=port)


def test_a_real_socket_wakes_the_node(udp):
    source, woken = udp(), []
    source.start(time.time_ns, lambda: woken.append(1))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(json.dumps(frame()).encode(), ("127.0.0.1", port_of(source)))
        wait_until(lambda: woken)

    assert source.take().person == ("anna",)
    assert source.report().message == "receiving from udp"


def test_the_example_sender_streams_a_recording(udp):
    source, frames = udp(), []
    source.start(time.time_ns, lambda: frames.append(source.take()))
    example = ROOT / "examples" / "udp_sender.py"
    command = [sys.executable, example, CSV, "--sensor", "right", "--port", str(port_of(source))]

    subprocess.run([*command, "--rate", "20"], check=True, timeout=PATIENCE_S)
    wait_until(lambda: len(frames) == 6)

    assert [each.person for each in frames] == [("anna",)] * 4 + [("anna", "ben"), ("anna",)]
    shoulder = frames[0].positions[0, JOINTS.index("left_shoulder")]
    assert np.isfinite(shoulder).all()
    assert source.counters["frames_lost"] == 0


def test_the_example_is_short_and_needs_only_python():
    text = (ROOT / "examples" / "udp_sender.py").read_text()

    assert len(text.splitlines()) <= 60
    imported = [line for line in text.splitlines() if line.startswith(("import", "from"))]
    modules = {line.split()[1].split(".")[0] for line in imported}
    assert modules <= sys.stdlib_module_names
