import re
from pathlib import Path

import pytest
from readme_tables import markdown_table

from pose_calibration.imus.parameters import ImuCalibrationParameters
from pose_calibration.parameters import LiveCalibrationParameters
from pose_core.fusion.parameters import FusionParameters
from pose_core.parameters import from_mapping, values_from_ros_yaml
from pose_fusion.recording.player_parameters import PlayerParameters
from pose_fusion.recording.recorder_parameters import RecorderParameters

PACKAGE = Path(__file__).parents[3] / "src" / "pose_fusion"
NODES = {
    "fusion": FusionParameters,
    "calibration": LiveCalibrationParameters,
    "imu_calibration": ImuCalibrationParameters,
    "recorder": RecorderParameters,
    "player": PlayerParameters,
}


@pytest.mark.parametrize("node", NODES)
def test_the_readmes_parameters_are_those_of_the_node(node):
    readme = (PACKAGE / "README.md").read_text()
    marked = rf"<!-- parameters: {node} -->\n(.*?)<!-- /parameters: {node} -->"
    found = re.search(marked, readme, re.DOTALL)
    assert found, f"no parameters of {node} in the README"
    assert found[1] == markdown_table(NODES[node])


@pytest.mark.parametrize("node", ["fusion", "calibration"])
def test_config_files_set_only_valid_parameters(node):
    values = values_from_ros_yaml(PACKAGE / "config" / f"{node}.yaml", node)
    assert values
    from_mapping(NODES[node], values)
