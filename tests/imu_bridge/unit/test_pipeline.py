"""Pipeline from bytes to samples with stamp, calibration and orientation."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imu_bridge.filters import FILTERS
from imu_bridge.parameters import ImuBridgeParameters
from imu_bridge.pipeline import Chunk, ImuBatch, ImuPipeline
from imu_bridge.protocols import star as protocol
from imu_bridge.protocols.star import RawSample, encode
from imu_bridge.protocols.text import TextParser, line_format
from imu_bridge.segments import ImuNode, Linear

MS = 1_000_000  # [ns]
START_NS = 1_700_000_000_000_000_000
TORSO = ImuNode(node_id=1, segment="torso")
THIGH = ImuNode(node_id=6, segment="left_thigh")
REST = RawSample(
    node_id=1,
    sequence=0,
    clock_us=0,
    accelerometer=(0, 0, 16384),
    gyroscope=(0, 0, 0),
    magnetometer=(0, 80, -160),
    magnetometer_valid=True,
)


def sample(k: int, node_id: int = 1, **fields) -> RawSample:
    return replace(REST, node_id=node_id, sequence=k % 65536, clock_us=k * 10_000, **fields)


def chunk(k: int, *samples: RawSample) -> Chunk:
    return Chunk(arrival_ns=START_NS + k * 10 * MS, data=b"".join(map(encode, samples)))


def test_samples_come_out_in_order_of_arrival_with_their_node():
    pipeline = ImuPipeline([TORSO, THIGH])
    batch = pipeline.process([chunk(0, sample(0, 6), sample(0, 1)), chunk(1, sample(1, 6))])
    assert batch.node.tolist() == [1, 0, 1]
    assert batch.stamp_ns == [START_NS, START_NS, START_NS + 10 * MS]


def test_no_bytes_make_an_empty_batch():
    batch = ImuPipeline([TORSO]).process([])
    assert len(batch) == 0
    assert batch.orientation.shape == (0, 4)


def test_a_sensor_at_rest_facing_north_is_the_identity():
    batch = ImuPipeline([TORSO]).process([chunk(0, sample(0))])
    np.testing.assert_allclose(batch.acceleration, [[0, 0, 9.80665]])
    np.testing.assert_allclose(batch.orientation, [[0, 0, 0, 1]], atol=1e-12)
    assert batch.heading_stddev[0] < np.pi


def test_without_a_magnetometer_there_is_no_heading_and_no_field():
    batch = ImuPipeline([TORSO]).process([chunk(0, sample(0, magnetometer_valid=False))])
    assert np.isnan(batch.raw_magnetic_field).all()
    assert batch.heading_stddev.tolist() == [np.pi]


def test_a_turn_is_integrated_over_the_nodes_own_clock():
    counts = 13107  # 200 deg/s at +-500 deg/s full scale, to 0.01 %
    turning = {"gyroscope": (0, 0, counts), "gyroscope_range": 1, "magnetometer_valid": False}
    pipeline = ImuPipeline([TORSO], ImuBridgeParameters(gyro_bias_window=0.0))
    batch = pipeline.process([chunk(k, sample(k, **turning)) for k in range(46)])
    turned = Rotation.from_quat(batch.orientation[0]).inv() * Rotation.from_quat(
        batch.orientation[-1]
    )
    angle = 45 * 0.01 * counts * protocol.GYROSCOPE_LSB[1]
    np.testing.assert_allclose(turned.as_rotvec(), [0, 0, angle], atol=1e-6)


def test_one_batch_or_many_give_the_same():
    def everything(group: int) -> list[ImuBatch]:
        rng = np.random.default_rng(2)
        pipeline = ImuPipeline([TORSO, THIGH])
        chunks = [
            chunk(
                k,
                *(
                    sample(k, node_id, gyroscope=tuple(map(int, rng.integers(-900, 900, 3))))
                    for node_id in (1, 6)
                ),
            )
            for k in range(40)
        ]
        return [pipeline.process(chunks[i : i + group]) for i in range(0, 40, group)]

    whole, parts = everything(40), everything(3)
    for name in ("orientation", "angular_velocity", "stamp_ns", "node"):
        np.testing.assert_allclose(
            np.concatenate([getattr(batch, name) for batch in parts]),
            getattr(whole[0], name),
            atol=1e-12,
        )


def test_calibration_goes_into_the_oriented_data_and_not_into_the_raw():
    node = ImuNode(
        node_id=1,
        segment="torso",
        gyroscope_bias=np.array([0.1, 0, 0]),
        accelerometer=Linear(offset=np.array([0, 0, 1.0]), matrix=np.diag([1, 1, 2.0])),
        magnetometer=Linear(offset=np.array([0, 48e-6, 0])),  # leaves (0, -24, -48) uT: south
    )
    pipeline = ImuPipeline([node], ImuBridgeParameters(gyro_bias_window=0.0))
    batch = pipeline.process([chunk(0, sample(0))])
    np.testing.assert_allclose(batch.raw_acceleration, [[0, 0, 9.80665]])
    np.testing.assert_allclose(batch.acceleration, [[0, 0, 2 * 8.80665]])
    np.testing.assert_array_equal(batch.raw_angular_velocity, [[0, 0, 0]])
    np.testing.assert_allclose(batch.angular_velocity, [[-0.1, 0, 0]])
    np.testing.assert_allclose(batch.raw_magnetic_field, [[0, 24e-6, -48e-6]])
    np.testing.assert_allclose(np.abs(batch.orientation), [[0, 0, 1, 0]], atol=1e-12)


def test_a_rest_removes_the_gyroscopes_bias():
    pipeline = ImuPipeline([TORSO], ImuBridgeParameters(filter="madgwick", gyro_bias_window=1.0))
    batch = pipeline.process([chunk(k, sample(k, gyroscope=(200, 0, 0))) for k in range(150)])
    assert batch.angular_velocity[10, 0] == pytest.approx(200 * protocol.GYROSCOPE_LSB[0])
    assert batch.angular_velocity[-1, 0] == pytest.approx(0, abs=1e-9)
    assert batch.raw_angular_velocity[-1, 0] == pytest.approx(200 * protocol.GYROSCOPE_LSB[0])


def test_frames_of_unknown_nodes_are_counted_by_id():
    pipeline = ImuPipeline([TORSO])
    batch = pipeline.process([chunk(0, sample(0, 9), sample(0), sample(1, 9), sample(0, 77))])
    assert len(batch) == 1
    assert pipeline.unknown_nodes == {(0, 9): 2, (0, 77): 1}


def test_repeated_and_late_frames_are_dropped_and_counted():
    pipeline = ImuPipeline([TORSO])
    batch = pipeline.process([chunk(5, *(sample(k) for k in (1, 2, 2, 4, 3, 5)))])
    assert len(batch) == 4
    assert np.all(np.diff(batch.stamp_ns) > 0)
    counters = pipeline.states[0].sequence.counters
    assert (counters["duplicates"], counters["late"], counters["lost"]) == (1, 1, 1)


def test_a_long_gap_begins_the_orientation_anew():
    pipeline = ImuPipeline([TORSO], ImuBridgeParameters(max_gap=1.0))
    pipeline.process([chunk(0, sample(0))])
    batch = pipeline.process([chunk(500, sample(500, accelerometer=(0, 16384, 0)))])
    up = Rotation.from_quat(batch.orientation[0]).apply([0, 1, 0])
    np.testing.assert_allclose(up, [0, 0, 1], atol=1e-9)
    assert pipeline.states[0].gaps == 1


def test_a_restarted_node_begins_anew_and_goes_on():
    pipeline = ImuPipeline([TORSO])
    pipeline.process([chunk(k, sample(k + 5000)) for k in range(3)])
    batch = pipeline.process([chunk(k, sample(k - 100)) for k in range(100, 103)])
    assert len(batch) == 3
    assert np.isfinite(batch.orientation).all()
    assert pipeline.states[0].sequence.counters["restarts"] == 1
    assert pipeline.states[0].clock.counters["clock_jumps"] == 1
    assert pipeline.states[0].gaps == 0


def test_saturated_samples_are_counted():
    pipeline = ImuPipeline([TORSO])
    pipeline.process([chunk(0, sample(0, gyroscope=(0, -32768, 0)), sample(1))])
    pipeline.process([chunk(2, sample(2, accelerometer=(32767, 0, 0)))])
    assert pipeline.states[0].saturated == 2


def test_a_cut_stream_does_not_join_halves_of_two_frames():
    data = encode(sample(0))
    pipeline = ImuPipeline([TORSO])
    cut = Chunk(arrival_ns=START_NS, data=b"")
    first, rest = (Chunk(arrival_ns=START_NS, data=part) for part in (data[:20], data[20:]))
    assert len(pipeline.process([first, cut, rest])) == 0
    assert pipeline.parsers[0].counters["bytes_skipped"] == 33
    assert len(pipeline.process([chunk(1, sample(1))])) == 1


def test_transport_delay_is_taken_off_the_stamps():
    parameters = ImuBridgeParameters(transport_delay=0.004)
    batch = ImuPipeline([TORSO], parameters).process([chunk(0, sample(0))])
    assert batch.stamp_ns == [START_NS - 4 * MS]


def test_a_sensor_that_measures_no_gravity_has_no_orientation_yet():
    batch = ImuPipeline([TORSO]).process([chunk(0, sample(0, accelerometer=(0, 0, 0)))])
    assert np.isnan(batch.orientation).all()


@pytest.mark.parametrize("filter_name", sorted(FILTERS))
@pytest.mark.parametrize("value", [2e3, 1e30, 1e308])
def test_one_absurd_sample_does_not_disturb_those_after_it(filter_name, value):
    fields = ["node", "acc_x", "acc_y", "acc_z", "gyro_x", "gyro_y", "gyro_z"]
    units = {"acc": "m/s^2", "gyro": "rad/s"}

    def orientations(absurd):
        parser = TextParser(line_format({"fields": fields, "units": units}))
        pipeline = ImuPipeline([TORSO], ImuBridgeParameters(filter=filter_name), [parser])
        pipeline.process([Chunk(arrival_ns=START_NS, data=b"\n")])
        found = []
        for k in range(50):
            line = b"1,0.5,0,9.8,0.1,0,0\n"
            if k == 20:
                line = absurd + line
            at_ns = START_NS + k * 10 * MS
            found.append(pipeline.process([Chunk(arrival_ns=at_ns, data=line)]).orientation[-1])
        return np.array(found), pipeline.states[0]

    expected, _ = orientations(b"")
    found, state = orientations(f"1,{value},{value},{value},0.1,{value},0\n".encode())
    np.testing.assert_array_equal(found, expected)
    assert state.implausible == 1
