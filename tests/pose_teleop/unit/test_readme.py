"""The README's tables and the configuration are those of the parameters."""

import pytest
from readme_tables import SRC, generated_part, markdown_table

from pose_core.parameters import from_mapping, values_from_ros_yaml
from pose_teleop.parameters import (
    ArmParameters,
    HoldParameters,
    HriParameters,
    RetargetParameters,
    SimulatedRobotParameters,
)

NODES = {
    "arm": ArmParameters,
    "retarget": RetargetParameters,
    "hri": HriParameters,
    "simulated_robot": SimulatedRobotParameters,
    "hold": HoldParameters,
}


@pytest.mark.parametrize("node", NODES)
def test_the_readmes_parameters_are_those_of_the_node(node):
    assert generated_part("pose_teleop", f"parameters: {node}") == markdown_table(NODES[node])


@pytest.mark.parametrize("file", ["panda", "arm_defaults"])
def test_config_files_set_only_valid_parameters(file):
    values = values_from_ros_yaml(SRC / "pose_teleop" / "config" / f"{file}.yaml", "arm")

    assert values
    from_mapping(ArmParameters, values)
