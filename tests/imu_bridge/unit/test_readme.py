"""README and example files agree with the code."""

import re
from pathlib import Path

import pytest
import yaml
from readme_tables import generated_part, markdown_table

from imu_bridge.devices import PortConfig, parse_devices, read_devices
from imu_bridge.filters import FILTERS
from imu_bridge.parameters import ImuBridgeParameters
from imu_bridge.protocols import PROTOCOLS, star as protocol
from imu_bridge.protocols.star import RawSample, StarParser, encode, reading
from pose_core.joints import SEGMENTS
from pose_core.parameters import from_mapping, specs, values_from_ros_yaml

PACKAGE = Path(__file__).parents[3] / "src" / "imu_bridge"
README = (PACKAGE / "README.md").read_text()
GUIDE = PACKAGE.parents[1] / "docs" / "imus.md"


def test_the_parameters_are_those_of_the_node():
    assert generated_part("imu_bridge", "parameters") == markdown_table(ImuBridgeParameters)


def test_the_frame_in_the_readme_decodes_to_the_documented_values():
    found = re.search(r"```hex\n(.*?)```", README, re.DOTALL)
    assert found
    sample = RawSample(
        node_id=3,
        sequence=258,
        clock_us=1_000_000,
        accelerometer=(0, 0, 16384),
        gyroscope=(131, 0, -131),
        magnetometer=(0, 80, -160),
        magnetometer_valid=True,
    )
    assert bytes.fromhex(found[1]) == encode(sample)
    assert StarParser().parse(encode(sample)) == [reading(sample)]


def test_the_ranges_in_the_readme_are_those_of_the_code():
    for code in range(4):
        g, dps, ut = (
            table[code]
            for table in (
                protocol.ACCELEROMETER_RANGES_G,
                protocol.GYROSCOPE_RANGES_DPS,
                protocol.MAGNETOMETER_LSB_UT,
            )
        )
        assert f"| {code} | ±{g:g} g | ±{dps:g} °/s | {ut:g} µT |" in README


def test_every_segment_has_a_line_on_strapping():
    for segment in SEGMENTS:
        assert f"| `{segment.removeprefix('left_').removeprefix('right_')}` |" in GUIDE.read_text()


def test_every_segment_is_in_the_drawing():
    drawing = (GUIDE.parent / "images" / "imu_placement.svg").read_text()
    for segment in SEGMENTS:
        assert f">{segment}</text>" in drawing


@pytest.mark.parametrize("name", PROTOCOLS)
def test_every_protocol_is_described(name: str):
    assert f"`protocol: {name}`" in README


@pytest.mark.parametrize("name", FILTERS)
def test_every_filter_is_described(name: str):
    assert f"| `{name}` |" in README


def test_the_example_of_several_ports_in_the_readme_is_read():
    found = re.search(r"```yaml\n(ports:\n.*?)```", README, re.DOTALL)
    assert found
    devices = parse_devices(yaml.safe_load(found[1]), PortConfig(name="sink"))
    assert [port.protocol for port in devices.ports] == ["witmotion", "text", "star"]
    assert [node.segment for node in devices.nodes] == [
        *("left_thigh", "right_thigh", "pelvis", "head"),
    ]


def test_the_example_of_witmotion_sensors_is_read():
    devices = read_devices(PACKAGE / "config" / "witmotion_nodes.yaml", PortConfig(name="sink"))
    assert len(devices.ports) == len(devices.nodes) == 5


def test_the_example_parameters_are_allowed_and_are_the_defaults():
    values = values_from_ros_yaml(PACKAGE / "config" / "imu_bridge.yaml", "imu_bridge")
    assert from_mapping(ImuBridgeParameters, values) == ImuBridgeParameters()


def test_the_launch_file_sets_parameters_that_exist():
    document = yaml.safe_load((PACKAGE / "launch" / "imu.launch.yaml").read_text())
    (node,) = [entry["node"] for entry in document["launch"] if "node" in entry]
    names = [entry["name"] for entry in node["param"] if "name" in entry]
    assert set(names) <= {*specs(ImuBridgeParameters), "autostart"}
