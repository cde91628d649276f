import numpy as np
import pytest

from pose_core.joints import JOINTS, TrackingState
from pose_io.recordings.joint_map_files import SHIPPED, shipped_joint_map
from pose_io.recordings.joint_maps import mark_missing

JOINT_MAPS = {name: shipped_joint_map(name) for name in SHIPPED}
AZURE_KINECT, KINECT_V2 = JOINT_MAPS["azure_kinect"], JOINT_MAPS["kinect_v2"]

# Where each SDK's documentation says that x, y, z point, its unit, and how many joints it has;
# written down here a second time, in words, so that a wrong matrix shows.
KNOWN = {
    "kinect_v1": ("left", "up", "forward", 1.0, 20),
    "utd_mhad": ("left", "up", "forward", 1.0, 20),
    "kinect_v2": ("left", "up", "forward", 1.0, 25),
    "azure_kinect": ("right", "down", "forward", 0.001, 32),
    "azure_kinect_ros": ("right", "down", "forward", 1.0, 32),
    "hiros": ("right", "down", "forward", 1.0, 32),
    "nite2": ("right", "up", "forward", 0.001, 15),
    "mediapipe": ("right", "down", "forward", 1.0, 33),
    "pose_15": ("right", "down", "forward", 1.0, 15),
    "openni_tf": ("forward", "left", "up", 1.0, 15),
    "smpl_24": ("forward", "left", "up", 1.0, 24),
    "zed_18": ("forward", "left", "up", 1.0, 18),
    "zed_34": ("forward", "left", "up", 1.0, 34),
    "zed_38": ("forward", "left", "up", 1.0, 38),
}
MEANS = {"zed_18": ("torso",), "mediapipe": ("neck", "torso")}  # of joints that have a name of ours
LIMB_ROOTS = ("left_hip", "right_hip", "left_shoulder", "right_shoulder")
DIRECTIONS = {
    "left": (-1, 0, 0),
    "right": (1, 0, 0),
    "up": (0, -1, 0),
    "down": (0, 1, 0),
    "forward": (0, 0, 1),
}

sensors = pytest.mark.parametrize("name", SHIPPED)


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


def as_sdk_gives_it(person: np.ndarray, name: str) -> np.ndarray:
    """The same person in an SDK's joints, axes and unit."""
    joint_map = JOINT_MAPS[name]
    *axes, unit_m, _ = KNOWN[name]
    basis = np.array([DIRECTIONS[axis] for axis in axes], dtype=float)
    joints = np.full((len(joint_map.joints), 3), np.nan)
    for ours, position in zip(JOINTS, person, strict=True):
        if ours in MEANS.get(name, ()):
            continue
        for theirs in joint_map.sources[ours]:
            joints[joint_map.joints.index(theirs)] = basis @ position / unit_m
    return joints


def test_every_shipped_map_is_known_here():
    assert set(KNOWN) == set(SHIPPED)


@sensors
def test_the_sdk_has_its_number_of_joints_each_once(name):
    joints = JOINT_MAPS[name].joints
    assert len(joints) == len(set(joints)) == KNOWN[name][-1]


@sensors
def test_every_joint_has_sources_in_the_sdk(name):
    joint_map = JOINT_MAPS[name]
    assert set(joint_map.sources) == set(JOINTS)
    for sources in joint_map.sources.values():
        assert set(sources) <= set(joint_map.joints)


@sensors
def test_no_limb_joint_of_the_sdk_serves_two_of_ours(name):
    sources = JOINT_MAPS[name].sources
    means = MEANS.get(name, ("torso",))
    used = [theirs for ours, each in sources.items() if ours not in means for theirs in each]
    assert len(used) == len(set(used))


@sensors
def test_sides_are_not_swapped(name):
    for ours, sources in JOINT_MAPS[name].sources.items():
        for source in sources:
            for side, other in (("left", "right"), ("right", "left")):
                if ours.startswith(side):
                    assert side in source.lower()
                    assert other not in source.lower()


@sensors
def test_a_person_from_an_sdk_has_the_true_position(name):
    person = facing_person()
    joints = as_sdk_gives_it(person, name)
    state = np.full(len(joints), TrackingState.TRACKED, dtype=np.uint8)

    positions, _ = JOINT_MAPS[name].convert(joints, state)

    neck, torso, *rest = (JOINTS.index(j) for j in ("neck", "torso", *LIMB_ROOTS))
    if "neck" in MEANS.get(name, ()):
        person[neck] = person[rest[2:]].mean(axis=0)
    if "torso" in MEANS.get(name, ()):
        person[torso] = 0.5 * (person[neck] + person[rest[:2]].mean(axis=0))
    np.testing.assert_allclose(positions, person, atol=1e-12)


@sensors
def test_left_up_and_forward_of_the_person_are_right_handed(name):
    joints = as_sdk_gives_it(facing_person(), name)
    positions, _ = JOINT_MAPS[name].convert(joints, np.full(len(joints), 2, dtype=np.uint8))
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
    joints = as_sdk_gives_it(facing_person(), "azure_kinect")
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
