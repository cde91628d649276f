"""Messages read from their bytes equal the deserialised messages."""

import numpy as np
import pytest

from pose_core.errors import InputError
from pose_core.joints import JOINTS
from pose_io.cdr.imu_bytes import imu_block
from pose_io.cdr.skeleton_bytes import SkeletonReader
from pose_io.skeleton_messages import skeleton_samples
from pose_io.typestore import make_typestore

TYPESTORE = make_typestore()
TYPES = TYPESTORE.types
S = 10**9


def header(stamp_ns, frame="kinect_left_optical_frame"):
    stamp = TYPES["builtin_interfaces/msg/Time"](*divmod(stamp_ns, S))
    return TYPES["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def person(rng, stamp_ns, name, joints=JOINTS):
    point = TYPES["geometry_msgs/msg/Point"]
    positions = rng.normal(0.0, 1.0, (len(joints), 3))
    positions[0], positions[1, 2], positions[2, 0] = 0.0, np.nan, 1e9
    return TYPES["pose_msgs/msg/Skeleton"](
        header=header(stamp_ns),
        id=name,
        name=list(joints),
        position=[point(*each) for each in positions],
        tracking_state=rng.integers(0, 3, len(joints)).astype(np.uint8),
    )


def array(stamp_ns, *persons):
    return TYPES["pose_msgs/msg/SkeletonArray"](header=header(stamp_ns), skeletons=list(persons))


def imu(rng, stamp_ns, frame="imu_torso_link"):
    quaternion = rng.normal(0.0, 1.0, 4)
    vector = TYPES["geometry_msgs/msg/Vector3"]
    return TYPES["sensor_msgs/msg/Imu"](
        header=header(stamp_ns, frame),
        orientation=TYPES["geometry_msgs/msg/Quaternion"](
            *(quaternion / np.linalg.norm(quaternion))
        ),
        orientation_covariance=rng.random(9),
        angular_velocity=vector(*rng.normal(0.0, 1.0, 3)),
        angular_velocity_covariance=rng.random(9),
        linear_acceleration=vector(*rng.normal(0.0, 9.0, 3)),
        linear_acceleration_covariance=rng.random(9),
    )


def serialized(message, little_endian=True):
    return bytes(TYPESTORE.serialize_cdr(message, message.__msgtype__, little_endian=little_endian))


@pytest.mark.parametrize("little_endian", [True, False])
def test_skeletons_of_any_form_are_read_as_from_the_deserialised_messages(little_endian):
    rng = np.random.default_rng(1)
    few = ("tail", "left_hand", "head")
    messages = []
    for k in range(40):
        stamp_ns = 5 * S + 33_333_333 * k
        seen = [person(rng, stamp_ns, "1")] if k % 4 else []
        seen += [person(rng, stamp_ns, "12345"[: k % 6], few)] if k % 3 else []
        messages.append(array(stamp_ns, *seen))
    read = SkeletonReader("left").read([serialized(m, little_endian) for m in messages])
    for message, persons in zip(messages, read, strict=True):
        expected = skeleton_samples(message, "left")
        assert [each.person for each in persons] == [each.person for each in expected]
        for one, other in zip(persons, expected, strict=True):
            assert (one.stamp_ns, one.sensor) == (other.stamp_ns, other.sensor)
            np.testing.assert_array_equal(one.positions, other.positions)
            np.testing.assert_array_equal(one.tracking_state, other.tracking_state)


def test_a_broken_message_has_an_error_and_does_not_affect_others():
    rng = np.random.default_rng(2)
    good = serialized(array(S, person(rng, S, "1")))
    strange = array(S, person(rng, S, "1"))
    strange.skeletons[0].tracking_state[4] = 7
    short = array(S, person(rng, S, "1"))
    short.skeletons[0].position = short.skeletons[0].position[:3]
    datas = [good, good[:100], serialized(strange), b"\0\1", serialized(short), b"", good]
    first, *broken, last = SkeletonReader("left").read(datas)
    assert len(first) == len(last) == 1
    reasons = ("ends after", "tracking state 7", "has 2 bytes", "3 positions", "has 0 bytes")
    for error, reason in zip(broken, reasons, strict=True):
        assert isinstance(error, InputError)
        assert reason in str(error)


@pytest.mark.parametrize(
    ("frame", "joints", "fault"),
    [
        ("kinect_left_optical_frame", JOINTS, ""),
        ("", JOINTS, ""),
        ("kinect_left_optical_frame", JOINTS[:9], ""),  # not all of ours
        ("kinect_left_optical_frame", (*JOINTS, "nose"), ""),  # more than ours
        ("map", JOINTS, "frame_id is 'map', expected 'kinect_left_optical_frame'"),
        (
            "kinect_left_optical_frame",
            [name.replace("left_knee", "left_kne") for name in JOINTS],
            "has joints left_kne, lacks left_knee",
        ),
    ],
)
def test_wrong_names_are_noted(frame, joints, fault):
    message = array(S, person(np.random.default_rng(4), S, "1", joints))
    message.header.frame_id = frame
    reader = SkeletonReader("left")
    reader.read([serialized(message)])
    assert fault in reader.fault
    assert bool(reader.fault) == bool(fault)


def test_imus_are_read_whatever_their_frames_are_called():
    rng = np.random.default_rng(3)
    frames = ("imu_torso_link", "torso", "")
    messages = [imu(rng, 7 * S + k, frames[k % 3]) for k in range(12)]
    block, kept = imu_block({"torso": [serialized(m) for m in messages]})
    assert kept.tolist() == [*range(12)]
    assert block.stamps_ns.tolist() == [7 * S + k for k in range(12)]
    for row, message in enumerate(messages):
        q, w = message.orientation, message.angular_velocity
        np.testing.assert_array_equal(block.orientation[row], [q.x, q.y, q.z, q.w])
        np.testing.assert_array_equal(block.angular_velocity[row], [w.x, w.y, w.z])
        a = message.linear_acceleration
        np.testing.assert_array_equal(block.linear_acceleration[row], [a.x, a.y, a.z])
        variances = message.orientation_covariance[[0, 4, 8]]
        np.testing.assert_allclose(block.orientation_stddev[row] ** 2, variances)


def test_impossible_accelerations_are_nan():
    rng = np.random.default_rng(6)
    told, denied, empty, absurd = (imu(rng, S + k) for k in range(4))
    denied.linear_acceleration_covariance[0] = -1.0  # REP 145
    empty.linear_acceleration = TYPES["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
    absurd.linear_acceleration.y = np.inf
    block, kept = imu_block({"torso": [serialized(m) for m in (told, denied, empty, absurd)]})
    assert kept.tolist() == [0, 1, 2, 3]
    known = np.isfinite(block.linear_acceleration)
    assert known.all(axis=1).tolist() == [True, False, False, False]
    assert not known[1:].any()


def test_angular_velocities_that_no_device_measures_are_none():
    rng = np.random.default_rng(7)
    told, denied, empty, absurd, huge = (imu(rng, S + k) for k in range(5))
    denied.angular_velocity_covariance[0] = -1.0  # REP 145
    empty.angular_velocity.x = np.nan
    absurd.angular_velocity.y = np.inf
    huge.angular_velocity.z = 1e30
    datas = [serialized(m) for m in (told, denied, empty, absurd, huge)]
    block, kept = imu_block({"torso": datas})
    assert kept.tolist() == [0, 1, 2, 3, 4]
    known = np.isfinite(block.angular_velocity)
    assert known.all(axis=1).tolist() == [True, False, False, False, False]
    assert not known[1:].any()


def test_an_imu_message_that_is_cut_off_is_left_out():
    rng = np.random.default_rng(4)
    datas = [serialized(imu(rng, S)), serialized(imu(rng, S))[:50], b""]
    block, kept = imu_block({"torso": datas})
    assert len(block) == 1
    assert kept.tolist() == [0]


def test_imus_of_several_segments_are_read_together():
    rng = np.random.default_rng(5)
    datas = {
        name: [serialized(imu(rng, S + k, f"imu_{name}_link")) for k in range(3)]
        for name in ("torso", "left_shank", "head")
    }
    block, kept = imu_block(datas)
    assert kept.tolist() == [*range(9)]
    assert [block.segments[i] for i in block.imu] == [n for n in datas for _ in range(3)]
    assert block.stamps_ns.tolist() == [S, S + 1, S + 2] * 3
    assert len(imu_block({})[0]) == 0
