"""Evaluation of launch files to processes."""

import shlex
import textwrap
from pathlib import Path

import pytest
import yaml

from pose_core.errors import InputError
from pose_launch.errors import LaunchError
from pose_launch.evaluation import LaunchEvaluation
from pose_launch.locating import find_launch_file


@pytest.fixture
def package(tmp_path, monkeypatch):
    """An installed package ``demo_pkg`` with an executable and a parameter file."""
    prefix = tmp_path / "prefix"
    share = prefix / "share" / "demo_pkg"
    for folder in (
        prefix / "share/ament_index/resource_index/packages",
        prefix / "lib" / "demo_pkg",
        share / "config",
        share / "launch",
    ):
        folder.mkdir(parents=True)
    (prefix / "share/ament_index/resource_index/packages/demo_pkg").touch()
    program = prefix / "lib/demo_pkg/talk"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    (share / "config/p.yaml").write_text("/**: {ros__parameters: {names: [left, right]}}\n")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(prefix))
    return prefix


@pytest.fixture
def evaluate(tmp_path, package):
    def evaluate(text, describe=False, **given):
        file = tmp_path / "x.launch.yaml"
        file.write_text(textwrap.dedent(text))
        return LaunchEvaluation(given, describe=describe).run(file)

    return evaluate


TALKER = """\
    launch:
    - arg: {name: "rate", default: "2.5", description: "publishing rate [Hz]"}
    - node:
        pkg: "demo_pkg"
        exec: "talk"
        name: "talker"
        namespace: "kinect_left"
        respawn: "true"
        param:
        - {from: "$(find-pkg-share demo_pkg)/config/p.yaml"}
        - {name: "rate", value: $(var rate)}
        remap:
        - {from: "chatter", to: "skeletons"}
    """


def test_a_node_gets_what_ros2_launch_passes(evaluate, package, tmp_path):
    (process,) = evaluate(TALKER).processes

    command = process.full_command(tmp_path)

    values_file = command[-1]
    assert command == [
        f"{package}/lib/demo_pkg/talk",
        "--ros-args",
        *("-r", "__node:=talker", "-r", "__ns:=/kinect_left", "-r", "chatter:=skeletons"),
        *("--params-file", f"{package}/share/demo_pkg/config/p.yaml"),
        *("--params-file", values_file),
    ]
    assert yaml.safe_load(Path(values_file).read_text()) == {
        "/kinect_left/talker": {"ros__parameters": {"rate": 2.5}}
    }
    assert process.respawn


def test_an_argument_given_overrides_its_default(evaluate):
    (process,) = evaluate(TALKER, rate="30.0").processes

    assert process.parameters[-1] == {"rate": 30.0}


def test_a_printed_command_is_a_shell_line(evaluate):
    (process,) = evaluate(TALKER).processes

    assert "rate:=2.5" in shlex.split(process.shown())


@pytest.mark.parametrize(
    ("entry", "expected"),
    [
        ('{name: x, value: "0"}', "0"),
        ("{name: x, value: 0}", 0),
        ("{name: x, value: 1.5}", 1.5),
        ("{name: x, value: true}", True),
        ('{name: x, value: "$(var number)"}', 7),
        ('{name: x, value: "$(var number)", type: "str"}', "7"),
        ('{name: x, value: "$(var number)", type: "float"}', 7.0),
        ("""{name: x, value: "'$(var number)'"}""", "7"),
        ('{name: x, value: "$(var empty)"}', ""),
        ('{name: x, value: "$(var empty)", type: "str"}', ""),
        ("{name: x, value: [a, b]}", ["a", "b"]),
        ("{name: x, value: [1, 2.5]}", [1.0, 2.5]),
        ('{name: x, value: "$(var list)"}', ["left", "right"]),
        ('{name: x, value: ["$(var number)"], type: "list_of_str"}', ["7"]),
    ],
)
def test_a_value_keeps_its_type(evaluate, entry, expected):
    graph = evaluate(f"""\
        launch:
        - let: {{name: "number", value: "7"}}
        - let: {{name: "empty", value: ""}}
        - let: {{name: "list", value: "[left, right]"}}
        - node: {{pkg: demo_pkg, exec: talk, param: [{entry}]}}
        """)

    (values,) = graph.processes[0].parameters
    assert values == {"x": expected}
    assert type(values["x"]) is type(expected)


@pytest.mark.parametrize(
    ("entry", "complaint"),
    [
        ("{name: x, value: []}", "not empty"),
        ("{name: x, value: [1, a]}", "one type"),
        ("{name: x}", "parameter 'x' lacks 'value'"),
        ("{value: 1}", "either 'from' or 'name'"),
        ('{name: x, value: "seven", type: "int"}', "not of type int"),
        ('{name: x, value: "[a, b]", type: "list_of_str"}', "only without 'type'"),
        ('{name: x, value: "1", type: "number"}', "is not one of bool, int"),
        ("{from: nowhere.yaml}", "found no parameter file nowhere.yaml"),
        ("{name: x, value: 1, unit: m}", "'unit', which is not supported"),
    ],
)
def test_a_bad_value_is_refused_with_its_line(evaluate, entry, complaint):
    with pytest.raises(LaunchError, match=complaint) as caught:
        evaluate(f"launch:\n- node: {{pkg: demo_pkg, exec: talk, param: [{entry}]}}\n")

    assert "x.launch.yaml:2: " in str(caught.value)


def test_conditions_decide_what_runs(evaluate):
    graph = evaluate(
        """\
        launch:
        - arg: {name: imus, default: "true"}
        - node: {pkg: demo_pkg, exec: talk, name: one, if: "$(var imus)"}
        - node: {pkg: demo_pkg, exec: talk, name: two, unless: "$(var imus)"}
        """,
        imus="false",
    )

    assert [process.name for process in graph.processes] == ["two"]


def test_a_group_keeps_its_variables_to_itself(evaluate):
    graph = evaluate("""\
        launch:
        - let: {name: which, value: outer}
        - group:
          - let: {name: which, value: inner}
          - node: {pkg: demo_pkg, exec: talk, name: "$(var which)"}
        - node: {pkg: demo_pkg, exec: talk, name: "$(var which)"}
        """)

    assert [process.name for process in graph.processes] == ["inner", "outer"]


def test_a_group_puts_its_nodes_into_a_namespace(evaluate):
    graph = evaluate(
        """\
        launch:
        - group:
            children:
            - push_ros_namespace: {namespace: "operator"}
            - node: {pkg: "demo_pkg", exec: "talk", name: "plain"}
            - node: {pkg: "demo_pkg", exec: "talk", name: "inner", namespace: "left"}
            - node: {pkg: "demo_pkg", exec: "talk", name: "absolute", namespace: "/left"}
            - group:
                children:
                - push_ros_namespace: {namespace: "arm"}
                - node: {pkg: "demo_pkg", exec: "talk", name: "nested"}
        - node: {pkg: "demo_pkg", exec: "talk", name: "outside"}
        """
    )
    assert {process.node_name: process.namespace for process in graph.processes} == {
        "plain": "/operator",
        "inner": "/operator/left",
        "absolute": "/left",
        "nested": "/operator/arm",
        "outside": None,
    }


def test_an_include_gets_its_arguments(evaluate, package):
    (package / "share/demo_pkg/launch/part.launch.yaml").write_text(
        textwrap.dedent("""\
            launch:
            - arg: {name: side}
            - node: {pkg: demo_pkg, exec: talk, name: "$(var side)", args: "$(var side)"}
            """)
    )
    graph = evaluate("""\
        launch:
        - include:
            file: "$(find-pkg-share demo_pkg)/launch/part.launch.yaml"
            arg:
            - {name: side, value: left}
        """)

    (process,) = graph.processes
    assert process.name == "left"
    assert process.command[1] == "left"


def test_equal_names_are_numbered(evaluate):
    graph = evaluate("""\
        launch:
        - node: {pkg: demo_pkg, exec: talk}
        - node: {pkg: demo_pkg, exec: talk}
        """)

    assert [process.name for process in graph.processes] == ["talk", "talk-2"]


def test_arguments_can_be_shown_without_running_anything(evaluate, tmp_path):
    mark = tmp_path / "mark"
    graph = evaluate(
        f"""\
        launch:
        - arg: {{name: needed, description: "must be there"}}
        - arg: {{name: now, default: "$(command 'touch {mark}')"}}
        - node: {{pkg: demo_pkg, exec: no_such_executable, args: "$(var needed)"}}
        """,
        describe=True,
    )

    assert [argument.name for argument in graph.arguments] == ["needed", "now"]
    assert not mark.exists()


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("launch:\n- arg: {name: x}", ":2: the argument 'x' must be given: x:=VALUE"),
        ("launch:\n- arg: {name: x, default: 2.5}", "is 2.5, not a text: put it in quotes"),
        ("launch:\n- timer: {period: 1.0}", "'timer' is not supported: there are arg"),
        ("launch:\n- node: {pkg: demo_pkg}", "'node' lacks 'exec'"),
        ("launch:\n- node: {pkg: no_pkg, exec: talk}", "found no package 'no_pkg'"),
        ("launch:\n- node: {pkg: demo_pkg, exec: walk}", "no executable 'walk': there are talk"),
        ("launch:\n- node: {pkg: demo_pkg, exec: talk, lauch: x}", "'lauch', which is not"),
        ("launch:\n- node: {pkg: demo_pkg, exec: talk, on_exit: x}", "expected 'shutdown'"),
        ("launch:\n- node: {pkg: demo_pkg, exec: talk, respawn_delay: -1.0}", "negative"),
        ("launch:\n- node: {pkg: demo_pkg, exec: talk, respawn_delay: 1}", "such as 1.0"),
        ("launch:\n- group: {scoped: false, children: []}", "'scoped', which is not supported"),
        ("launch:\n- include: {file: nowhere.launch.yaml}", "found no launch file nowhere"),
        ("launch:\n- node\n", "is not one action"),
        ("launch:\n- executable: {cmd: ''}", "lacks 'cmd'"),
        ("launch: 5", "'launch' holds 5"),
        ("nodes: []", "not a ROS 2 YAML launch file"),
        ("launch: [", ":1: not valid YAML|:2: not valid YAML"),
        ("launch:\n- let: {name: a, name: b, value: c}", "'name' occurs twice"),
        ("launch:\n- node: {pkg: demo_pkg, exec: $(var x)}", ":2: .*nothing of that name is set"),
    ],
)
def test_a_bad_file_is_refused_in_one_line(evaluate, text, complaint):
    with pytest.raises(LaunchError, match=complaint) as caught:
        evaluate(text)

    assert "\n" not in str(caught.value)
    assert "x.launch.yaml" in str(caught.value)


def test_an_undeclared_argument_is_refused(evaluate):
    with pytest.raises(InputError, match="no argument 'rte': there are rate"):
        evaluate(TALKER, rte="1.0")


def test_a_launch_file_is_found_by_its_bare_name(package):
    file = package / "share/demo_pkg/launch/start.launch.yaml"
    file.write_text("launch: []")

    assert find_launch_file("start.launch.yaml") == file
    assert find_launch_file("start") == file


def test_a_missing_launch_file_is_named(package):
    with pytest.raises(InputError, match="found no launch file 'nothing'"):
        find_launch_file("nothing")


def test_an_argument_that_an_include_decides_cannot_be_given(evaluate, package):
    (package / "share/demo_pkg/launch/part.launch.yaml").write_text(
        "launch: [arg: {name: side}, arg: {name: rate, default: '1.0'}]\n"
    )
    text = """\
        launch:
        - include:
            file: "$(find-pkg-share demo_pkg)/launch/part.launch.yaml"
            arg: [{name: side, value: left}]
        """

    assert [argument.name for argument in evaluate(text).arguments] == ["rate"]
    with pytest.raises(InputError, match="no argument 'side': there are rate"):
        evaluate(text, side="right")


def test_a_required_argument_has_to_be_passed_by_the_include(evaluate, package):
    """As for ``ros2 launch``, which looks no further than the include."""
    (package / "share/demo_pkg/launch/part.launch.yaml").write_text("launch: [arg: {name: side}]\n")
    text = """\
        launch:
        - arg: {name: side}
        - include: {file: "$(find-pkg-share demo_pkg)/launch/part.launch.yaml"}
        """

    with pytest.raises(LaunchError, match="a file that includes this one has to pass it"):
        evaluate(text, side="left")


def test_a_file_that_includes_itself_is_refused(evaluate, tmp_path):
    with pytest.raises(InputError, match="includes itself"):
        evaluate(f"launch:\n- include: {{file: {tmp_path}/x.launch.yaml}}\n")
