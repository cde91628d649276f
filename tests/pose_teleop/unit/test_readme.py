"""The README's tables and the configuration are those of the parameters."""

import re
from pathlib import Path

import pytest
from readme_tables import markdown_table

from pose_core.parameters import from_mapping, values_from_ros_yaml
from pose_teleop.parameters import (
    ArmParameters,
    HoldParameters,
    HriParameters,
    RetargetParameters,
    SimulatedRobotParameters,
)

PACKAGE = Path(__file__).parents[3] / "src" / "pose_teleop"
NODES = {
    "arm": ArmParameters,
    "retarget": RetargetParameters,
    "hri": HriParameters,
    "simulated_robot": SimulatedRobotParameters,
    "hold": HoldParameters,
}


@pytest.mark.parametrize("node", NODES)
def test_the_readmes_parameters_are_those_of_the_node(node):
    readme = (PACKAGE / "README.md").read_text()
    marked = rf"<!-- parameters: {node} -->\n(.*?)<!-- /parameters: {node} -->"
    found = re.search(marked, readme, re.DOTALL)

    assert found, f"no parameters of {node} in the README"
    assert found[1] == markdown_table(NODES[node])


@pytest.mark.parametrize("file", ["panda", "arm_defaults"])
def test_the_config_files_set_only_what_exists_and_is_allowed(file):
    values = values_from_ros_yaml(PACKAGE / "config" / f"{file}.yaml", "arm")

    assert values
    from_mapping(ArmParameters, values)
