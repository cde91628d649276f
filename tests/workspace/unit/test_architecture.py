"""The architecture, read from the imports."""

import ast
import json
from pathlib import Path

import pytest

SRC = Path(__file__).resolve().parents[3] / "src"
PACKAGES = sorted(setup.parent.name for setup in SRC.glob("*/setup.py"))
_PURE = {"pose_core", "pose_calibration", "pose_io", "pose_evaluation"}
ALLOWED = {
    "pose_core": set(),
    "pose_calibration": {"pose_core"},
    "pose_io": {"pose_core"},
    "pose_evaluation": {"pose_core", "pose_io"},
    "pose_node": {"pose_core"},
    "pose_launch": {"pose_core", "pose_node"},
    "kinect_bridge": {"pose_core", "pose_io", "pose_node"},
    "imu_bridge": {"pose_core", "pose_node"},
    "pose_fusion": {*_PURE, "pose_node"},
    "pose_sim": {"pose_core", "pose_io", "pose_node", "imu_bridge"},
    "pose_teleop": {"pose_core", "pose_node"},
    "pose_view": {*_PURE, "pose_node", "pose_fusion"},
    "pose_bench": {
        *_PURE,
        "pose_node",
        "pose_launch",
        "kinect_bridge",
        "imu_bridge",
        "pose_fusion",
        "pose_sim",
        "pose_teleop",
    },
}
"""Which of our packages a package's modules may import (messages aside)."""


CORE = (
    "kernels",
    "body",
    "streams",
    "session",
    "imu",
    "estimates",
    "filter",
    "baseline_filters",
    "estimators",
    "fusion",
    "people",
)
"""The folders of ``pose_core`` from the lowest up; its other modules lie below, the API above."""
LIGHT = {
    f"pose_core.{name}"
    for name in (
        "arrays",
        "joints",
        "errors",
        "stamps",
        "counters",
        "parameters",
        "finite_numbers",
        "plain_yaml",
        "atomic_file",
        "lower_line",
    )
}
"""Modules of the core that are public beside ``pose_core.api``: they load no numba."""
BEYOND_THE_DOOR = {
    # It finds the values that the core uses, on the core's geometry.
    "pose_calibration": {
        "pose_core.body.shape",
        "pose_core.body.trunk",
        "pose_core.filter.tracker_errors",
        "pose_core.imu.angular_velocity_check",
        "pose_core.imu.burst_stamps",
    },
    # It compiles kernels of its own.
    "pose_io": {"pose_core.kernels.compiling"},
    # It shows how the first compilation goes.
    "pose_fusion": {"pose_core.kernels.compiling"},
}
"""What else of the core a package may import; the benches, which measure parts of it, anything."""


def modules():
    """Every module of every package: dotted name and file."""
    return {
        ".".join(path.relative_to(SRC / package).with_suffix("").parts): path
        for package in PACKAGES
        for path in sorted((SRC / package / package).rglob("*.py"))
    }


MODULES = modules()


def imports(path):
    """The dotted names that a module imports when it is loaded or later, with ``from`` parts."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            found.update(f"{node.module}.{alias.name}" for alias in node.names)
    return found


def modules_imported(path):
    """The modules of ours that a module imports, when it is loaded, later or for types only."""
    found = {name if name in MODULES else name.rpartition(".")[0] for name in imports(path)}
    return (found & MODULES.keys()) - {".".join(path.relative_to(SRC).with_suffix("").parts[1:])}


def is_ros(name):
    top = name.split(".")[0]
    return top == "rclpy" or top.startswith("tf2_") or top.endswith(("_msgs", "_srvs"))


def may_use_ros(path):
    return "nodes" in path.parts or path.name == "conversions.py"


def test_there_are_modules_to_look_at():
    assert set(PACKAGES) >= {"pose_core", "kinect_bridge", "imu_bridge", "pose_fusion"}
    assert set(PACKAGES) == set(ALLOWED)


@pytest.mark.parametrize("package", PACKAGES)
def test_ros_is_imported_only_in_nodes_and_conversions(package):
    offenders = {
        name: sorted(filter(is_ros, imports(path)))
        for name, path in MODULES.items()
        if name.split(".")[0] == package and not may_use_ros(path)
    }

    assert {name: found for name, found in offenders.items() if found} == {}


@pytest.mark.parametrize("package", PACKAGES)
def test_packages_import_only_lower_packages(package):
    others = set(PACKAGES) - {package} - ALLOWED.get(package, set())
    offenders = {
        name: sorted(found)
        for name, path in MODULES.items()
        if name.split(".")[0] == package
        and (found := {i for i in imports(path) if i.split(".")[0] in others})
    }

    assert offenders == {}


@pytest.mark.parametrize("package", PACKAGES)
def test_pure_modules_do_not_import_nodes_or_tools(package):
    offenders = {
        name: sorted(found)
        for name, path in MODULES.items()
        if name.split(".")[0] == package
        and not {"nodes", "tools"} & set(path.parts)
        and (
            found := {
                i
                for i in imports(path)
                if i.split(".")[0] in PACKAGES and {"nodes", "tools"} & set(i.split("."))
            }
        )
    }

    assert offenders == {}


def test_there_are_no_import_cycles():
    graph = {name: modules_imported(path) for name, path in MODULES.items()}
    settled = set()

    def visit(name, trail):
        assert name not in trail, f"circular import: {' -> '.join([*trail, name])}"
        if name not in settled:
            for target in sorted(graph[name]):
                visit(target, [*trail, name])
            settled.add(name)

    for name in sorted(graph):
        visit(name, [])
    assert settled == set(MODULES)


def test_folders_of_the_core_import_only_lower_folders():
    def height(name):
        if name == "pose_core.api":
            return len(CORE)
        folder = name.split(".")[1]
        return CORE.index(folder) if folder in CORE else -1

    core = {name: path for name, path in MODULES.items() if name.startswith("pose_core.")}
    offenders = {
        (name, target)
        for name, path in core.items()
        for target in modules_imported(path) & core.keys()
        if height(target) > height(name)
    }

    assert offenders == set()
    assert {name.split(".")[1] for name in core if name.count(".") > 1} == set(CORE)


@pytest.mark.parametrize("package", PACKAGES)
def test_every_import_of_ours_and_of_ros_is_a_declared_dependency(package):
    declared = (SRC / package / "package.xml").read_text()
    used = {
        name.split(".")[0]
        for module, path in MODULES.items()
        if module.split(".")[0] == package
        for name in imports(path)
    }
    wanted = {name for name in used if name in PACKAGES or is_ros(f"{name}.")} - {package}

    assert {name for name in wanted if f">{name}</" not in declared} == set()


@pytest.mark.parametrize("package", sorted(set(PACKAGES) - {"pose_core", "pose_bench"}))
def test_the_core_is_used_through_its_api(package):
    doors = {"pose_core.api", *LIGHT, *BEYOND_THE_DOOR.get(package, set())}
    offenders = {
        (name, i)
        for name, path in MODULES.items()
        if name.split(".")[0] == package
        for i in imports(path)
        if i.startswith("pose_core.") and not {i, i.rpartition(".")[0]} & doors
    }

    assert offenders == set()


def test_every_listed_exception_to_the_api_is_used():
    used = {
        (name.split(".")[0], i.rpartition(".")[0])
        for name, path in MODULES.items()
        for i in imports(path)
    }

    listed = {(package, each) for package, names in BEYOND_THE_DOOR.items() for each in names}
    assert listed <= used


@pytest.mark.parametrize("package", PACKAGES)
def test_colcon_finds_the_tests_of_a_package(package):
    """It starts pytest in the package's folder, and only where the package asks for pytest."""
    tests = Path(__file__).parents[2] / package
    options = json.loads((SRC / package / "colcon.pkg").read_text())["pytest-args"]
    descriptions = [SRC / package / name for name in ("setup.py", "pyproject.toml")]

    assert tests.is_dir()
    assert [(SRC / package / each).resolve() for each in options if each.startswith("..")] == [
        SRC.parent / "pyproject.toml",
        tests,
    ]
    assert any('["pytest"]' in each.read_text() for each in descriptions if each.exists())
