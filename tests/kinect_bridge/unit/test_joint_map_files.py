"""Users' joint maps: valid ones, and errors of one line."""

import numpy as np
import pytest

from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, JOINTS
from pose_io.recordings.joint_map_files import find_joint_map

AXES = "axes: {x: right, y: down, z: forward}\n"


@pytest.fixture
def write(tmp_path):
    def write(text):
        path = tmp_path / "map.yaml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return str(path)

    return write


def test_a_map_based_on_another_replaces_its_keys(write):
    own = find_joint_map(write("like: azure_kinect\nunit: cm\nmap: {left_hand: HAND_LEFT}\n"))

    assert own.sources["left_hand"] == ("HAND_LEFT",)
    assert own.sources["right_hand"] == ("WRIST_RIGHT",)
    assert own.unit_m == 0.01
    assert own.confidence == find_joint_map("azure_kinect").confidence


def test_joints_may_be_indices_and_need_no_list(write):
    own = find_joint_map(write(AXES + "map: {head: 3, neck: [0, 1], left_knee: knee_l}\n"))

    assert own.joints == ("0", "1", "2", "3", "knee_l")
    assert own.sources["neck"] == ("0", "1")


def test_joints_that_the_map_lacks_are_never_tracked(write):
    own = find_joint_map(write(AXES + "map: {head: a, neck: b}\n"))

    positions, states = own.convert(np.ones((2, 3)), np.full(2, 2, np.uint8))

    assert states.sum() == 4
    assert np.isfinite(positions).all(axis=1).sum() == 2


def test_a_source_that_stands_twice_counts_twice(write):
    own = find_joint_map(write(AXES + "map: {torso: [a, a, b, c]}\n"))

    positions, _ = own.convert(np.diag([4.0, 4.0, 4.0]), np.full(3, 2, np.uint8))

    np.testing.assert_allclose(positions[JOINT_INDEX["torso"]], [2.0, 1.0, 1.0])


def test_confidence_becomes_a_state_and_unknown_confidence_counts_as_tracked(write):
    text = AXES + "map: {head: a}\nconfidence: {inferred: 0.2, tracked: 0.6}\n"
    own = find_joint_map(write(text))

    assert own.states(np.array([0.0, 0.2, 0.5, 0.6, np.nan])).tolist() == [0, 1, 1, 2, 2]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "holds no joint map"),
        ("[1, 2]", "holds no joint map"),
        ("map: {head: a}\ncolour: red\n", "unknown key 'colour'"),
        ("like: azure_kinekt\n", "like = 'azure_kinekt' is not one of the maps"),
        ("like: [nite2]\n", "is not one of the maps"),
        (AXES, "'map' is missing"),
        (AXES + "map: {}\n", "'map' is missing"),
        (AXES + "map: {tail: a}\n", "map has 'tail', which is not one of our joints"),
        (AXES + "map: {head: []}\n", "map of 'head' is []"),
        (AXES + "map: {head: {a: b}}\n", "map of 'head'"),
        (AXES + "map: {head: true}\n", "map of 'head'"),
        (AXES + "joints: [a]\nmap: {head: b}\n", "made from 'b', which is not one of the 1 joints"),
        (AXES + "joints: [a]\nmap: {head: 1}\n", "made from 1"),
        (AXES + "joints: [a]\nmap: {head: -1}\n", "made from -1"),
        (AXES + "joints: [a, a]\nmap: {head: a}\n", "2 names, 1 of them different"),
        (AXES + "joints: a\nmap: {head: a}\n", "expected a list of names"),
        (AXES + "map: {head: 100000000}\n", "made from 100000000"),
        (AXES + f"map: {{head: {'a' * 100}}}\n", "expected 1 to 64 characters"),
        ("map: {head: a}\n", "axes = None"),
        ("axes: {x: right, y: right, z: up}\nmap: {head: a}\n", "are not perpendicular"),
        ("axes: {x: right, y: down, z: 3}\nmap: {head: a}\n", "axes ="),
        (AXES + "unit: inch\nmap: {head: a}\n", "unit = 'inch'"),
        (AXES + "unit: [m]\nmap: {head: a}\n", "unit ="),
        (AXES + "map: {head: a}\nconfidence: {inferred: 2, tracked: 1}\n", "confidence ="),
        (AXES + "map: {head: a}\nconfidence: {inferred: .nan, tracked: 1}\n", "confidence ="),
        (AXES + "map: {head: a}\nconfidence: 3\n", "confidence ="),
        ("map: &m {head: a}\naxes: *m\n", r"line 2: an alias \(\*name\) is not allowed"),
        ("unit: m\nunit: mm\n", "line 2: 'unit' occurs twice"),
        ("!!python/object/apply:os.system ['true']\n", "could not determine a constructor"),
        ("[" * 10_000, "more than 32 levels are nested"),
        ("map: {head: a", "line"),
        (b"\xff\xfe\x00\xd8", "is not plain YAML"),
        ("x: " + "a" * 270_000, "larger than 256 kB"),
    ],
)
def test_what_is_no_joint_map_is_refused_in_one_line(write, text, said):
    with pytest.raises(InputError, match=said.replace("[]", r"\[\]")) as error:
        find_joint_map(write(text))
    assert "\n" not in str(error.value)


def test_a_map_that_is_not_there_names_those_that_are(tmp_path):
    with pytest.raises(InputError, match=r"give the path of a YAML file, or one of azure_kinect,"):
        find_joint_map(str(tmp_path / "none.yaml"))


def test_our_own_map_has_our_own_order():
    assert find_joint_map("pose_15").joints == JOINTS
