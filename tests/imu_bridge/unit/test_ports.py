"""The pipeline with several ports, and with devices without sequence numbers and clock."""

import numpy as np
from scipy.spatial.transform import Rotation

from imu_bridge.filters.heading import UNKNOWN_HEADING
from imu_bridge.parameters import ImuBridgeParameters
from imu_bridge.pipeline import Chunk, ImuBatch, ImuPipeline
from imu_bridge.protocols.reading import Parser
from imu_bridge.protocols.text import TextParser, line_format
from imu_bridge.protocols.witmotion import WitMotionParser
from imu_bridge.segments import ImuNode
from pose_sim.text_device import FIELDS, UNITS, line
from pose_sim.witmotion_device import packets

MS = 1_000_000  # [ns]
START_NS = 1_700_000_000_000_000_000
RATE = 1.0  # [rad/s] about z
FORMAT = line_format({"fields": list(FIELDS), "units": UNITS})


def text_sample(k: int) -> bytes:
    return line(10_000 * k, [0, 0, 9.80665], [0, 0, RATE], [0, 22e-6, -42e-6])


def witmotion_sample(k: int, content: tuple[int, ...] = (0x51, 0x52)) -> bytes:
    turned = Rotation.from_euler("z", RATE * 0.01 * k)
    return packets(
        acceleration=[0, 0, 9.80665],
        angular_velocity=[0, 0, RATE],
        orientation=turned.as_quat(),
        time_us=86_399_990_000 + 10_000 * k,  # midnight comes at once
        content=content,
    )


def pipeline(*parsers: Parser, **options) -> ImuPipeline:
    nodes = [
        ImuNode(node_id=0, segment=segment, port=port)
        for port, segment in zip(range(len(parsers)), ("torso", "head"), strict=False)
    ]
    return ImuPipeline(nodes, parsers=parsers, **options)


def run(subject: ImuPipeline, make, samples: int, port: int = 0) -> ImuBatch:
    return subject.process(
        [Chunk(arrival_ns=START_NS + 10 * MS * k, data=make(k), port=port) for k in range(samples)]
    )


def turned(batch: ImuBatch) -> float:
    """The turn between the first and the last orientation [rad]."""
    first, last = Rotation.from_quat(batch.orientation[[0, -1]])
    return float((last * first.inv()).as_rotvec()[2])


def test_ports_speak_their_own_languages():
    subject = pipeline(TextParser(FORMAT), WitMotionParser())
    batch = subject.process(
        [
            Chunk(arrival_ns=START_NS, data=b"\n" + text_sample(0), port=0),
            Chunk(arrival_ns=START_NS, data=witmotion_sample(0) * 2, port=1),
        ]
    )
    assert batch.node.tolist() == [0, 1, 1]


def test_a_node_on_another_port_is_another_node():
    subject = ImuPipeline(
        [ImuNode(node_id=0, segment="torso", port=1)],
        parsers=[WitMotionParser(), WitMotionParser()],
    )
    run(subject, witmotion_sample, 5, port=0)
    assert subject.unknown_nodes == {(0, 0): 5}


def test_samples_without_number_and_time_are_integrated_over_their_even_spacing():
    parameters = ImuBridgeParameters(magnetometer="off", gyro_bias_window=0.0)
    subject = pipeline(WitMotionParser(), parameters=parameters)
    batch = run(subject, witmotion_sample, 200)
    assert np.all(np.diff(batch.stamp_ns) > 0)
    seconds = (batch.stamp_ns[-1] - batch.stamp_ns[0]) * 1e-9
    assert abs(turned(batch) - RATE * seconds) < 0.01
    counts = subject.states[0].sequence.counters
    assert (counts["frames"], counts["lost"], counts["restarts"]) == (200, 0, 0)


def test_the_sensors_clock_is_followed_over_midnight():
    subject = pipeline(WitMotionParser())
    batch = run(subject, lambda k: witmotion_sample(k, (0x50, 0x51, 0x52)), 50)
    # That a sampling is complete shows when the second begins: the first comes with it.
    np.testing.assert_allclose(np.diff(batch.stamp_ns)[2:], 10 * MS, atol=0.01 * MS)
    assert subject.states[0].clock.counters["clock_jumps"] == 0


def test_a_clock_in_milliseconds_is_used_where_lines_have_one():
    subject = pipeline(TextParser(FORMAT))
    late = [START_NS + 10 * MS * k + (7 * MS if k % 3 else 0) for k in range(60)]
    batch = subject.process(
        [Chunk(arrival_ns=ns, data=b"\n" * (k == 0) + text_sample(k)) for k, ns in enumerate(late)]
    )
    np.testing.assert_allclose(np.diff(batch.stamp_ns), 10 * MS, atol=0.2 * MS)


def test_a_sensors_own_orientation_is_handed_on_by_the_filter_device():
    subject = pipeline(WitMotionParser(), parameters=ImuBridgeParameters(filter="device"))
    batch = run(subject, lambda k: witmotion_sample(k, (0x51, 0x52, 0x59)), 50)
    assert abs(turned(batch) - RATE * 0.01 * (len(batch) - 1)) < 1e-3
    assert (batch.heading_stddev == UNKNOWN_HEADING).all()


def test_a_cut_ends_half_a_packet():
    subject = pipeline(WitMotionParser())
    half = witmotion_sample(0)[:15]
    cut = Chunk(arrival_ns=START_NS, data=b"")
    subject.process([Chunk(arrival_ns=START_NS, data=half), cut])
    assert subject.parsers[0].counters["bytes_skipped"] == 4
    assert len(run(subject, witmotion_sample, 3)) == 3
