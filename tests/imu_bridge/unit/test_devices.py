"""Ports in the nodes file."""

import pytest

from imu_bridge.devices import PortConfig, parse_devices
from pose_core.errors import InputError

SINK = PortConfig(name="/dev/sink")
WIT = {"protocol": "witmotion", "segment": "torso"}
TEXT = {
    "protocol": "text",
    "segment": "head",
    "fields": ["acc_x", "acc_y", "acc_z", "gyro_x", "gyro_y", "gyro_z"],
    "units": {"acc": "g", "gyro": "deg/s"},
}


def test_nodes_alone_are_those_of_the_star_network():
    devices = parse_devices({"nodes": {3: "torso"}}, SINK)
    assert devices.ports == (SINK,)
    assert [(node.port, node.node_id) for node in devices.nodes] == [(0, 3)]


def test_ports_alone_need_no_star_network():
    devices = parse_devices({"ports": {"/dev/a": WIT, "/dev/b": TEXT}}, SINK)
    assert [port.name for port in devices.ports] == ["/dev/a", "/dev/b"]
    assert [(node.port, node.segment) for node in devices.nodes] == [(0, "torso"), (1, "head")]


def test_both_together_share_the_bridge():
    devices = parse_devices({"nodes": {1: "pelvis"}, "ports": {"/dev/a": WIT}}, SINK)
    assert [port.protocol for port in devices.ports] == ["star", "witmotion"]
    assert [node.port for node in devices.nodes] == [0, 1]


def test_a_port_has_its_protocols_default_speed_unless_one_is_given():
    devices = parse_devices({"ports": {"/dev/a": WIT, "/dev/b": {**TEXT, "baudrate": 57600}}}, SINK)
    assert [port.baudrate for port in devices.ports] == [115200, 57600]


def test_a_port_of_several_text_sensors_names_them_by_id():
    entry = {**TEXT, "fields": ["node", *TEXT["fields"]], "nodes": {4: "head", 5: "torso"}}
    del entry["segment"]
    devices = parse_devices({"ports": {"/dev/a": entry}}, SINK)
    assert [node.node_id for node in devices.nodes] == [4, 5]


@pytest.mark.parametrize(
    ("ports", "message"),
    [
        ({}, "expected a mapping 'ports'"),
        ({"/dev/a": {"segment": "torso"}}, "/dev/a: protocol None is not one of star, witmotion"),
        ({"/dev/a": {**WIT, "protocol": "x"}}, "protocol 'x' is not one of"),
        ({"/dev/a": {**WIT, "protocol": {}}}, "protocol {} is not one of"),
        ({"/dev/a": {**WIT, "fields": []}}, "/dev/a: unknown key 'fields'"),
        ({"/dev/a": {**WIT, "baudrate": "fast"}}, "baudrate = 'fast' is not an integer"),
        ({"/dev/a": {"protocol": "witmotion"}}, "/dev/a: node 0: segment None"),
        ({"/dev/a": {**TEXT, "units": {}}}, "/dev/a: unit of acc = None"),
        ({"/dev/a": WIT, "/dev/b": WIT}, "'torso' is given to /dev/a and /dev/b"),
        ({"/dev/a": {"protocol": "star", "nodes": {}}}, "/dev/a: expected a mapping 'nodes'"),
    ],
)
def test_nonsense_about_a_port_is_refused(ports: dict, message: str):
    with pytest.raises(InputError, match=message):
        parse_devices({"ports": ports}, SINK)


def test_the_star_networks_port_cannot_be_another_devices_too():
    with pytest.raises(InputError, match="'/dev/sink' is also that of the star network"):
        parse_devices({"nodes": {1: "head"}, "ports": {"/dev/sink": WIT}}, SINK)
