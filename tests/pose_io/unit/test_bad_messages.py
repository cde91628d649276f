"""Invalid messages of sensors: their values are left out."""

import dataclasses

import numpy as np
import pytest

from pose_core.errors import InputError
from pose_core.joints import JOINTS, TrackingState
from pose_io.cdr.imu_bytes import imu_block
from pose_io.cdr.skeleton_bytes import FORM_BYTES_KEPT, NO_POSITION, SkeletonReader
from pose_io.skeleton_messages import skeleton_sample
from pose_io.static_transforms import transforms_to_map
from pose_io.typestore import make_typestore

TYPESTORE = make_typestore()
TYPES = TYPESTORE.types
HEADER = TYPES["std_msgs/msg/Header"](
    stamp=TYPES["builtin_interfaces/msg/Time"](sec=1, nanosec=0), frame_id="map"
)
IDENTITY = (0.0, 0.0, 0.0, 1.0)


def skeleton(position=(0.1, 0.2, 2.0), state=2):
    point = TYPES["geometry_msgs/msg/Point"]
    return TYPES["pose_msgs/msg/Skeleton"](
        header=HEADER,
        id="1",
        name=list(JOINTS),
        position=[point(x=0.1, y=0.2, z=2.0)] * 14 + [point(*position)],
        tracking_state=np.array([2] * 14 + [state], np.uint8),
    )


def imu(variance=0.01, rate=0.1):
    vector = TYPES["geometry_msgs/msg/Vector3"]
    covariance = np.full(9, variance)
    return TYPES["sensor_msgs/msg/Imu"](
        header=HEADER,
        orientation=TYPES["geometry_msgs/msg/Quaternion"](*IDENTITY),
        orientation_covariance=covariance,
        angular_velocity=vector(x=rate, y=0.0, z=0.0),
        angular_velocity_covariance=covariance,
        linear_acceleration=vector(x=0.0, y=0.0, z=9.8),
        linear_acceleration_covariance=covariance,
    )


def serialized(messages):
    return [bytes(TYPESTORE.serialize_cdr(each, each.__msgtype__)) for each in messages]


def transform(child, parent="map", rotation=IDENTITY, x=0.0):
    return TYPES["geometry_msgs/msg/TransformStamped"](
        header=TYPES["std_msgs/msg/Header"](stamp=HEADER.stamp, frame_id=parent),
        child_frame_id=child,
        transform=TYPES["geometry_msgs/msg/Transform"](
            translation=TYPES["geometry_msgs/msg/Vector3"](x=x, y=0.0, z=0.0),
            rotation=TYPES["geometry_msgs/msg/Quaternion"](*rotation),
        ),
    )


@pytest.mark.parametrize(
    "position",
    [(np.nan, 0.2, 2.0), (np.inf, 0.2, 2.0), (1e30, 0.2, 2.0), (0.1, -1e300, 2.0), (0.0, 0.0, 0.0)],
)
def test_a_joint_that_cannot_be_there_is_not_tracked(position):
    sample = skeleton_sample(skeleton(position), "left")
    assert np.isnan(sample.positions[-1]).all()
    assert sample.tracking_state[-1] == TrackingState.NOT_TRACKED
    assert np.isfinite(sample.positions[:-1]).all()


def test_an_unknown_tracking_state_is_refused():
    with pytest.raises(InputError, match="has the tracking state 3: expected 0"):
        skeleton_sample(skeleton(state=3), "left")


@pytest.mark.parametrize("variance", [np.nan, np.inf])
def test_an_imu_with_invalid_variances_is_ignored(variance):
    block, kept = imu_block({"torso": serialized([imu(), imu(variance=variance), imu()])})
    assert kept.tolist() == [0, 2]
    assert len(block) == 2


def test_a_bad_transform_of_another_frame_does_not_matter():
    placed = transforms_to_map(
        [transform("gripper", rotation=(0.0,) * 4), transform("kinect_left_optical_frame")]
    )
    assert list(placed) == ["left"]


@pytest.mark.parametrize("values", [{"rotation": (0.0,) * 4}, {"x": np.nan}, {"x": 1e300}])
def test_a_bad_transform_of_a_sensor_is_refused(values):
    with pytest.raises(InputError, match="the transform of kinect_left_optical_frame"):
        transforms_to_map([transform("kinect_left_optical_frame", **values)])


def test_messages_of_many_lengths_leave_little_behind():
    reader = SkeletonReader("left")
    message = TYPES["pose_msgs/msg/SkeletonArray"]
    for length in range(400):
        names = ["x" * length, *JOINTS[1:]]
        person = dataclasses.replace(skeleton(), name=names)
        data = TYPESTORE.serialize_cdr(
            message(header=HEADER, skeletons=[person] * 8), message.__msgtype__
        )
        (persons,) = reader.read([bytes(data)])
        assert len(persons) == 8

    kept = sum(
        form.fixed.nbytes + form.texts.nbytes for forms in reader._forms.values() for form in forms
    )
    assert kept <= FORM_BYTES_KEPT


def test_a_message_of_a_megabyte_is_refused():
    (error,) = SkeletonReader("left").read([b"\0\1\0\0" + b"\0" * 1_000_000])
    assert isinstance(error, InputError)
    assert "expected 5 to 262144" in str(error)


@pytest.mark.parametrize("position", [(100.0, 200.0, 2000.0), (np.nan,) * 3, (0.0, 0.0, 0.0)])
def test_tracked_joints_without_any_position_are_a_fault(position):
    reader, one = SkeletonReader("left"), skeleton(position)
    header = dataclasses.replace(HEADER, frame_id="")
    for positions, fault in (([one.position[-1]] * 15, NO_POSITION), (one.position, "")):
        each = dataclasses.replace(one, position=positions)
        array = TYPES["pose_msgs/msg/SkeletonArray"](header=header, skeletons=[each])
        reader.read(serialized([array]))
        assert reader.fault == fault
