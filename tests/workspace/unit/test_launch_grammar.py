"""Every launch file of ours is one of ``ros2 launch``, by its grammar and its scoping rules."""

from pathlib import Path

import pytest
import yaml
from launch_grammar import complaints

SRC = Path(__file__).resolve().parents[3] / "src"
FILES = sorted(SRC.glob("*/launch/*.launch.yaml"))


def walk(actions):
    for action in actions:
        ((kind, element),) = action.items()
        yield kind, element
        if kind == "group":
            yield from walk(element["children"] if isinstance(element, dict) else element)


def test_there_are_launch_files():
    assert {"capture", "demo", "fusion", "imu", "kinect", "sensors", "view"} <= {
        file.name.split(".")[0] for file in FILES
    }


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_a_launch_file_uses_only_elements_of_the_yaml_front_end(file):
    assert complaints(file) == []


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_nodes_of_a_launch_file_are_respawned(file):
    for kind, element in walk(yaml.safe_load(file.read_text())["launch"]):
        if kind == "node":
            assert element.get("respawn") == "true", element["exec"]
            assert 0.0 < element["respawn_delay"] <= 1.0


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("- arg: {name: x, default: 2.5}", "'default' of 'arg' is 2.5"),
        ("- node: {pkg: a, exec: b, respawn_delay: 1}", "'respawn_delay' of 'node' is 1"),
        ("- node: {pkg: a}", "'node' lacks 'exec'"),
        ("- node: {pkg: a, exec: b, params: []}", "has no attribute 'params'"),
        ("- node: {pkg: a, exec: b, param: [{value: $(dirname)}]}", r"\$\(dirname …\)"),
        (
            "- node: {pkg: a, exec: b, param: [{name: x, value: $(var y), type: list_of_str}]}",
            "'value' of 'param' is '$(var y)', not a list",
        ),
        ("- let: {name: x, value: $(equals $(var y) '')}", "an empty argument"),
        ("- group: {scoped: 'false', children: []}", "'scoped' of 'group' is 'false'"),
        ("- group: [{nod: {}}]", "no action 'nod'"),
        ("- include: {file: $(dirname)/x.yaml}", r"\$\(dirname …\)"),
    ],
)
def test_the_grammar_rejects_invalid_launch_files(tmp_path, text, complaint):
    file = tmp_path / "x.launch.yaml"
    file.write_text(f"launch:\n{text}\n")

    (found,) = complaints(file)

    assert complaint.replace("\\", "") in found
