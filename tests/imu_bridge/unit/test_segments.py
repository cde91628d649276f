"""The nodes file."""

from pathlib import Path

import numpy as np
import pytest

from imu_bridge.devices import PortConfig, read_devices
from pose_core.errors import InputError

SINK = PortConfig(name="sink")
EXAMPLE = Path(__file__).parents[3] / "src" / "imu_bridge" / "config" / "imu_nodes.yaml"


def read(tmp_path: Path, text: str):
    path = tmp_path / "nodes.yaml"
    path.write_text(text)
    return read_devices(path, SINK).nodes


def test_the_example_names_nine_segments():
    segments = {node.segment for node in read_devices(EXAMPLE, SINK).nodes}
    limbs = ("upper_arm", "forearm", "thigh", "shank")
    assert segments == {"torso", *(f"{s}_{limb}" for s in ("left", "right") for limb in limbs)}


def test_a_plain_segment_has_no_calibration(tmp_path: Path):
    (node,) = read(tmp_path, "nodes: {7: left_hand}")
    assert (node.node_id, node.segment) == (7, "left_hand")
    np.testing.assert_array_equal(node.gyroscope_bias, np.zeros(3))
    for calibration in (node.accelerometer, node.magnetometer):
        np.testing.assert_array_equal(calibration.offset, np.zeros(3))
        np.testing.assert_array_equal(calibration.matrix, np.eye(3))


def test_calibration_is_read(tmp_path: Path):
    (node,) = read(
        tmp_path,
        """
        nodes:
          0:
            segment: pelvis
            gyroscope_bias: [0.1, -0.2, 3e-3]
            accelerometer: {offset: [1, 2, 3]}
            magnetometer: {offset: [1e-6, 0, 0], matrix: [[1, 0.1, 0], [0.1, 1, 0], [0, 0, 2]]}
        """,
    )
    np.testing.assert_array_equal(node.gyroscope_bias, [0.1, -0.2, 3e-3])
    np.testing.assert_array_equal(node.accelerometer.offset, [1, 2, 3])
    np.testing.assert_array_equal(node.magnetometer.matrix, [[1, 0.1, 0], [0.1, 1, 0], [0, 0, 2]])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nodes: {1: elbow}", "node 1: segment 'elbow' is not one of pelvis, torso"),
        ("nodes: {1: torso, 2: torso}", "'torso' is given to nodes 1 and 2"),
        ("nodes:\n  1: torso\n  1: head", "'1' occurs twice"),
        ("nodes: {256: torso}", "node id 256 is not an integer from 0 to 255"),
        ("nodes: {-1: torso}", "node id -1"),
        ("nodes: {left: torso}", "node id 'left'"),
        ("nodes: {true: torso}", "node id True"),
        ("nodes: {}", "expected a mapping 'nodes'"),
        ("nodes: [torso]", "expected a mapping 'nodes'"),
        ("", "expected a mapping with nodes, ports"),
        ("segments: {1: torso}", "unknown key 'segments'"),
        ("nodes: {1: 5}", "node 1: expected a mapping"),
        ("nodes: {1: {gyroscope_bias: [0, 0, 0]}}", "node 1: segment None"),
        ("nodes: {1: {segment: head, gyro: [0, 0, 0]}}", "node 1: unknown key 'gyro'"),
        ("nodes: {1: {segment: head, gyroscope_bias: [0, 0]}}", "is not 3 numbers"),
        ("nodes: {1: {segment: head, gyroscope_bias: [0, 0, .nan]}}", "is not 3 numbers"),
        ("nodes: {1: {segment: head, gyroscope_bias: fast}}", "is not 3 numbers"),
        (
            "nodes: {1: {segment: head, accelerometer: {matrix: [[1, 0], [0, 1]]}}}",
            "node 1: accelerometer: matrix = .* is not 3 x 3 numbers",
        ),
        (
            "nodes: {1: {segment: head, magnetometer: "
            "{matrix: [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}}}",
            "magnetometer: matrix has determinant -1",
        ),
        ("nodes: {1: [}", "is not plain YAML"),
    ],
)
def test_nonsense_is_refused_in_one_line(tmp_path: Path, text: str, message: str):
    with pytest.raises(InputError, match=message) as caught:
        read(tmp_path, text)
    assert "\n" not in str(caught.value)
    assert "nodes.yaml" in str(caught.value)


def test_a_missing_file_is_named(tmp_path: Path):
    with pytest.raises(InputError, match=r"cannot read the nodes file .*none.yaml: No such file"):
        read_devices(tmp_path / "none.yaml", SINK)
