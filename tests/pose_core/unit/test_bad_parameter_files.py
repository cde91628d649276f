"""Parameter files and tables with keys that nobody expects."""

from dataclasses import dataclass

import pytest

from imu_bridge.devices import PortConfig, read_devices
from pose_core.errors import InputError, ParameterError
from pose_core.parameters import from_mapping, parameter, values_from_ros_yaml


@dataclass(frozen=True, kw_only=True)
class Parameters:
    rate: float = parameter(30.0, unit="Hz", doc="how often")


def test_a_non_string_key_is_reported_as_an_unknown_parameter():
    with pytest.raises(ParameterError, match="unknown parameter 3: expected some of rate"):
        from_mapping(Parameters, {3: 1.0})


def test_a_file_without_the_nodes_section_is_refused(tmp_path):
    path = tmp_path / "parameters.yaml"
    path.write_text("fusio: {ros__parameters: {rate: 3.0}}")
    with pytest.raises(InputError, match="holds nothing for 'fusion', only fusio"):
        values_from_ros_yaml(path, "fusion")
    path.write_text("/**: {ros__parameters: {rate: 3.0}}")
    assert values_from_ros_yaml(path, "fusion") == {"rate": 3.0}


def test_a_key_that_is_a_list_is_refused(tmp_path):
    path = tmp_path / "nodes.yaml"
    path.write_text("nodes: {? [1, 2] : torso}")
    with pytest.raises(InputError, match="cannot be a key"):
        read_devices(path, PortConfig(name="sink"))
