"""Whatever a package imports, it declares: by rosdep key, or in its own requirements."""

import ast
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
PACKAGES = {setup.parent.name: setup.parent for setup in sorted((ROOT / "src").glob("*/setup.py"))}
KEYS = {"cv2": "python3-opencv", "serial": "python3-serial", "yaml": "python3-yaml"}
"""Rosdep keys that are not ``python3-`` and the module's name."""
WITH_ANOTHER = {"markupsafe": "jinja2"}
OPTIONAL = {"opensim", "distributed"}  # said where it is wanted and not installed


def foreign_imports(folder):
    found = set()
    for path in (folder / folder.name).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                found |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                found.add(node.module.split(".")[0])
    own = set(PACKAGES) | set(sys.stdlib_module_names) | OPTIONAL
    return {WITH_ANOTHER.get(name, name) for name in found - own}


def requirements(path):
    lines = path.read_text().splitlines() if path.exists() else []
    lines = [line.split("#")[0].strip() for line in lines]
    return {re.split(r"[<>=]", line)[0]: line for line in lines if line}


def pip_names(folder):
    project = folder / "pyproject.toml"
    names = (
        re.findall(r'(?:^    |= \[)"([\w-]+)', project.read_text(), re.M)
        if project.exists()
        else []
    )
    return {name.lower() for name in names}


@pytest.mark.parametrize("folder", PACKAGES.values(), ids=PACKAGES)
def test_every_foreign_import_is_declared(folder):
    manifest = (folder / "package.xml").read_text()
    declared = set(re.findall(r"<(?:exec_|build_)?depend>([^<]+)<", manifest))
    own = requirements(folder / "requirements.txt")

    missing = {
        name
        for name in foreign_imports(folder)
        if not {name, KEYS.get(name, f"python3-{name}")} & declared and name not in own
    }

    assert missing == set()


@pytest.mark.parametrize("folder", PACKAGES.values(), ids=PACKAGES)
def test_requirements_of_a_package_are_in_the_common_requirements(folder):
    names = ("python.in", "teleop.in")
    whole = {k: v for name in names for k, v in requirements(ROOT / "requirements" / name).items()}

    locked = requirements(ROOT / "requirements/installed-ros.in")
    for name, line in requirements(folder / "requirements.txt").items():
        assert whole[name] == locked[name] == line


@pytest.mark.parametrize("folder", PACKAGES.values(), ids=PACKAGES)
def test_what_pip_installs_with_it_is_what_its_requirements_name(folder):
    if not (folder / "pyproject.toml").exists():
        pytest.skip("colcon alone installs it")

    assert set(requirements(folder / "requirements.txt")) <= pip_names(folder)
