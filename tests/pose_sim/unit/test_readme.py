import ast
from pathlib import Path

import pytest
from readme_tables import generated_part, markdown_table

from pose_sim.choreography import CHOREOGRAPHIES
from pose_sim.imu_noise import ImuParameters
from pose_sim.kinect_noise import KinectParameters
from pose_sim.scene import SceneParameters
from pose_sim.timeline import Variation

PACKAGE = Path(__file__).parents[3] / "src" / "pose_sim"
README = (PACKAGE / "README.md").read_text()


@pytest.mark.parametrize("declared", [SceneParameters, Variation, KinectParameters, ImuParameters])
def test_the_table_of_parameters_is_the_declaration(declared):
    name = f"parameters: {declared.__name__}"
    assert generated_part("pose_sim", name) == markdown_table(declared)


def test_every_choreography_is_described():
    for name in CHOREOGRAPHIES:
        assert f"| `{name}` |" in README


def imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module


def test_the_simulator_imports_neither_the_fusion_nor_ros():
    paths = list(PACKAGE.rglob("*.py"))
    assert len(paths) > 20
    for path in paths:
        for name in imports(path):
            root = name.split(".")[0]
            assert root not in ("pose_fusion", "rclpy"), path
            assert not root.endswith("_msgs"), path
