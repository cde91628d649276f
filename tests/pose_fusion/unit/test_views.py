"""The RViz configuration and the Foxglove layout: they show what the fusion publishes."""

import json
import re
from pathlib import Path

import pytest
import yaml
from ament_index_python.packages import get_package_share_directory

from pose_core.body.model import ROOT_DOF, available_models, load_body_model
from pose_fusion.conversions import body_topics, type_name, urdf_topic

SOURCE = Path(__file__).resolve().parents[3] / "src" / "pose_fusion"
TYPES = {topic: type_name(kind) for topic, kind in body_topics("subject").items()}
TOPICS = {*TYPES, urdf_topic("subject"), "/diagnostics"}


@pytest.fixture(scope="module")
def displays():
    document = yaml.safe_load((SOURCE / "rviz" / "pose.rviz").read_text())
    assert document["Visualization Manager"]["Global Options"]["Fixed Frame"] == "map"
    return {
        display["Class"].split("/")[1]: display
        for display in document["Visualization Manager"]["Displays"]
    }


@pytest.fixture(scope="module")
def layout():
    return json.loads((SOURCE / "foxglove" / "pose.json").read_text())


@pytest.mark.parametrize("name", ["rviz/pose.rviz", "foxglove/pose.json"])
def test_the_layouts_are_installed_with_the_package(name):
    installed = Path(get_package_share_directory("pose_fusion")) / name
    assert installed.read_text() == (SOURCE / name).read_text()


def test_rviz_reads_the_body_from_the_latched_urdf(displays):
    topic = displays["RobotModel"]["Description Topic"]
    assert topic["Value"] == urdf_topic("subject")
    assert topic["Durability Policy"] == "Transient Local"


def test_rviz_shows_the_markers_under_their_topic(displays):
    topic = displays["MarkerArray"]["Topic"]["Value"]
    assert TYPES[topic] == "visualization_msgs/msg/MarkerArray"


def test_foxglove_uses_only_published_topics(layout):
    named = set(re.findall(r'"(/humans/[^".]+)', json.dumps(layout)))
    assert named
    assert named <= TOPICS
    assert layout["configById"]["DiagnosticSummary!nodes"]["topicToRender"] in TOPICS


@pytest.mark.parametrize("model", available_models())
def test_every_curve_shows_the_joint_of_its_label(layout, model):
    names = load_body_model(model).dof_names[ROOT_DOF:]
    curves = [
        path
        for panel in layout["configById"].values()
        for path in panel.get("paths", [])
        if "joint_states" in path["value"]
    ]
    assert len(curves) == 8
    for curve in curves:
        index = int(re.search(r"position\[(\d+)\]", curve["value"])[1])
        assert names[index] == curve["label"].replace(" ", "_")


def test_every_panel_of_the_layout_has_its_place(layout):
    def panels(node):
        return {node} if isinstance(node, str) else panels(node["first"]) | panels(node["second"])

    assert panels(layout["layout"]) == set(layout["configById"])
