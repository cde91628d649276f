import numpy as np
import pytest

from pose_core.joints import JOINTS, TrackingState
from pose_io.recordings.joint_maps import AZURE_KINECT, JOINT_MAPS, KINECT_V2, mark_missing

# Where each SDK's documentation says that x, y, z point, and its unit; written down here a second
# time, in words, so that a wrong matrix shows.
AXES = {
    "Kinect v1": ("left", "up", "forward", 1.0),
    "Kinect v2": ("left", "up", "forward", 1.0),
    "Azure Kinect": ("right", "down", "forward", 0.001),
    "NiTE2": ("right", "up", "forward", 0.001),
}
DIRECTIONS = {
    "left": (-1, 0, 0),
    "right": (1, 0, 0),
    "up": (0, -1, 0),
    "down": (0, 1, 0),
    "forward": (0, 0, 1),
}
COUNTS = {"Kinect v1": 20, "Kinect v2": 25, "Azure Kinect": 32, "NiTE2": 15}

sensors = pytest.mark.parametrize("joint_map", JOINT_MAPS.values(), ids=JOINT_MAPS.keys())


def facing_person() -> np.ndarray:
    """A person who faces the sensor, (15, 3) in the optical frame: the left is at +x."""
    middle = {"head": (0, -0.6), "neck": (0, -0.4), "torso": (0, -0.1)}
    limbs = {
        "shoulder": (0.2, -0.35),
        "elbow": (0.25, -0.05),
        "hand": (0.3, 0.2),
        "hip": (0.1, 0.15),
        "knee": (0.1, 0.55),
        "foot": (0.1, 0.95),
    }
    points = []
    for name in JOINTS:
        side, _, joint = name.partition("_")
        x, y = middle.get(name) or limbs[joint]
        points.append((x if side == "left" else -x, y, 2.5))
    return np.array(points)


def as_sdk_gives_it(person: np.ndarray, joint_map) -> np.ndarray:
    """The same person in an SDK's joints, axes and unit."""
    *axes, unit_m = AXES[joint_map.sensor]
    basis = np.array([DIRECTIONS[axis] for axis in axes], dtype=float)
    joints = np.full((len(joint_map.joints), 3), np.nan)
    for ours, position in zip(JOINTS, person, strict=True):
        for theirs in joint_map.sources[ours]:
            joints[joint_map.joints.index(theirs)] = basis @ position / unit_m
    return joints


@sensors
def test_the_sdk_has_its_number_of_joints_each_once(joint_map):
    assert len(joint_map.joints) == len(set(joint_map.joints)) == COUNTS[joint_map.sensor]


@sensors
def test_every_joint_of_ours_has_one_or_two_sources_that_the_sdk_knows(joint_map):
    assert set(joint_map.sources) == set(JOINTS)
    for sources in joint_map.sources.values():
        assert 1 <= len(sources) <= 2
        assert set(sources) <= set(joint_map.joints)


@sensors
def test_no_joint_of_the_sdk_serves_two_of_ours(joint_map):
    used = [source for sources in joint_map.sources.values() for source in sources]
    assert len(used) == len(set(used))


@sensors
def test_sides_are_not_swapped(joint_map):
    for ours, sources in joint_map.sources.items():
        for source in sources:
            for side, other in (("left", "right"), ("right", "left")):
                if ours.startswith(side):
                    assert side in source.lower()
                    assert other not in source.lower()


@sensors
def test_a_person_seen_through_an_sdk_is_where_it_stands(joint_map):
    person = facing_person()
    joints = as_sdk_gives_it(person, joint_map)
    state = np.full(len(joints), TrackingState.TRACKED, dtype=np.uint8)

    positions, _ = joint_map.convert(joints, state)

    np.testing.assert_allclose(positions, person, atol=1e-12)


@sensors
def test_left_up_and_forward_of_the_person_are_right_handed(joint_map):
    joints = as_sdk_gives_it(facing_person(), joint_map)
    positions, _ = joint_map.convert(joints, np.full(len(joints), 2, dtype=np.uint8))
    at = dict(zip(JOINTS, positions, strict=True))

    left = at["left_shoulder"] - at["right_shoulder"]
    up = at["neck"] - at["torso"]
    towards_sensor = np.array([0.0, 0.0, -1.0])

    assert np.cross(left, up) @ towards_sensor > 0
    assert left[0] > 0


def test_frames_and_persons_are_converted_all_at_once():
    joints = np.random.default_rng(0).normal(size=(7, 25, 3))
    state = np.full((7, 25), 2, dtype=np.uint8)

    positions, states = KINECT_V2.convert(joints, state)

    assert positions.shape == (7, 15, 3)
    assert states.shape == (7, 15)
    one, _ = KINECT_V2.convert(joints[3], state[3])
    np.testing.assert_array_equal(positions[3], one)


def test_a_mean_of_two_is_tracked_as_badly_as_the_worse():
    joints = as_sdk_gives_it(facing_person(), AZURE_KINECT)
    state = np.full(32, TrackingState.TRACKED, dtype=np.uint8)
    state[AZURE_KINECT.joints.index("EAR_LEFT")] = TrackingState.INFERRED

    _, states = AZURE_KINECT.convert(joints, state)

    assert states[JOINTS.index("head")] == TrackingState.INFERRED
    assert states[JOINTS.index("neck")] == TrackingState.TRACKED


def test_a_joint_without_position_or_state_has_neither():
    positions = np.zeros((3, 3))
    positions[0, 1] = np.inf
    state = np.array([2, 0, 1], dtype=np.uint8)

    mark_missing(positions, state)

    assert state.tolist() == [0, 0, 1]
    assert np.isnan(positions[:2]).all()
    assert (positions[2] == 0).all()
