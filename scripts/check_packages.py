"""Installs each package with its declared dependencies in an empty virtual environment and runs it.

Only the dependencies in `package.xml` (rosdep keys) and `requirements.txt` are installed, and those
of the required packages of this workspace. Then every module is imported and every executable is
run with `--help`. Run by `scripts/check_packages.sh`.
"""

import argparse
import configparser
import os
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PIP_NAMES = {
    "python3-opencv": "opencv-python-headless",
    "python3-serial": "pyserial",
    "python3-yaml": "PyYAML",
}
"""Names on PyPI by rosdep key, where it is not the key without `python3-`."""
BUILT_HERE = {"pose_msgs": "install", "tf2_msgs": "underlay/install"}
"""Interfaces that colcon has built, by their folder in POSE_HOME."""
MIDDLEWARE = "rmw_fastrtps_cpp"  # part of any ROS, but not of rclpy's wheel
IMPORT_ALL = """\
import importlib, pkgutil, sys
package = importlib.import_module(sys.argv[1])
for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
    importlib.import_module(module.name)
"""


class Package:
    """One package of the workspace with its declared dependencies."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.name = folder, folder.name
        manifest = ElementTree.parse(folder / "package.xml").getroot()
        depends = {
            node.text or "" for tag in ("depend", "exec_depend") for node in manifest.iter(tag)
        }
        own = {setup.parent.name for setup in (ROOT / "src").glob("*/setup.py")}
        self.packages = depends & own
        self.keys = depends - own
        file = folder / "requirements.txt"
        lines = file.read_text().splitlines() if file.exists() else []
        self.requirements = {line.split("#")[0].strip() for line in lines} - {""}


def with_its_own(package: Package, packages: dict[str, Package]) -> list[Package]:
    """The package, preceded by the packages of the workspace that it requires."""
    found: dict[str, Package] = {}

    def visit(one: Package) -> None:
        for name in sorted(one.packages):
            visit(packages[name])
        found[one.name] = one

    visit(package)
    return list(found.values())


def run(command: list[str], environment: dict[str, str]) -> None:
    """Run a command; an error message ends with its output."""
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        said = (done.stdout + done.stderr).strip()
        raise RuntimeError(f"{' '.join(command)}\n{said}")


class Checker:
    """Creates the environments.

    Args:
        home: The prepared environment, POSE_HOME.
        folder: A scratch folder.
    """

    def __init__(self, home: Path, folder: Path) -> None:
        self._home, self._folder = home, folder
        self._uv = str(home / "venv/bin/uv")
        self._python = str(home / "venv/bin/python")
        self._plain = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith(("ROS_", "_ROS", "AMENT", "CMAKE", "COLCON", "PYTHON", "LD_"))
        }
        self._pins = folder / "pins.txt"
        frozen = subprocess.run(
            [self._uv, "pip", "freeze", "--quiet", "--python", self._python, "--exclude-editable"],
            env=self._plain,
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        # Links to the workspace's own packages are not pinned versions.
        self._pins.write_text("\n".join(line for line in frozen.splitlines() if "==" in line))

    def build(self, package: Package) -> Path:
        """Build a wheel in a copy, since setuptools builds beside the sources."""
        copy = self._folder / "sources" / package.name
        shutil.copytree(package.folder, copy, ignore=shutil.ignore_patterns("*.egg-info", "build"))
        out = self._folder / "wheels" / package.name
        run([self._uv, "build", "--quiet", "--wheel", "-o", str(out), str(copy)], self._plain)
        (wheel,) = out.glob("*.whl")
        return wheel

    def check(self, needed: list[Package], wheels: dict[str, Path]) -> int:
        """Install the last package and run it; returns the number of its executables."""
        package = needed[-1]
        venv = self._folder / "venvs" / package.name
        run([self._uv, "venv", "--quiet", "--python", self._python, str(venv)], self._plain)
        keys = {key for each in needed for key in each.keys}
        wanted = [
            *(f"ros-{key.replace('_', '-')}" for key in keys if self._is_wheel(key)),
            *(
                PIP_NAMES.get(k, k.removeprefix("python3-"))
                for k in keys
                if k.startswith("python3-")
            ),
            *(line for each in needed for line in each.requirements),
            *([f"ros-{MIDDLEWARE.replace('_', '-')}"] if "rclpy" in keys else []),
        ]
        install = [self._uv, "pip", "install", "--quiet", "--python", str(venv / "bin/python")]
        if wanted:
            run([*install, "--constraint", str(self._pins), *wanted], self._plain)
        run([*install, "--no-deps", *(str(wheels[each.name]) for each in needed)], self._plain)
        environment = self._environment(venv, keys)
        python = str(venv / "bin/python")
        run([self._uv, "pip", "check", "--quiet", "--python", python], self._plain)
        run([python, "-c", IMPORT_ALL, package.name], environment)
        executables = executables_of(wheels[package.name])
        for executable in executables:
            run([str(venv / "bin" / executable), "--help"], environment)
        shutil.rmtree(venv)
        return len(executables)

    def _is_wheel(self, key: str) -> bool:
        return not key.startswith("python3-") and key not in BUILT_HERE

    def _environment(self, venv: Path, keys: set[str]) -> dict[str, str]:
        built = [self._home / BUILT_HERE[key] / key for key in sorted(keys & set(BUILT_HERE))]
        site = f"lib/python{sys.version_info.major}.{sys.version_info.minor}/site-packages"
        return {
            **self._plain,
            "AMENT_PREFIX_PATH": ":".join(map(str, [*built, venv])),
            "PYTHONPATH": ":".join(str(one / site) for one in built),
            "LD_LIBRARY_PATH": ":".join(str(one / "lib") for one in built),
            "MPLBACKEND": "Agg",
        }


def executables_of(wheel: Path) -> list[str]:
    """The console scripts that a wheel declares."""
    with zipfile.ZipFile(wheel) as archive:
        names = [name for name in archive.namelist() if name.endswith("entry_points.txt")]
        if not names:
            return []
        parser = configparser.ConfigParser()
        parser.read_string(archive.read(names[0]).decode())
    return sorted(parser["console_scripts"]) if "console_scripts" in parser else []


def main() -> int:
    """Check the named packages, or all; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("home", type=Path, help="the prepared environment")
    parser.add_argument("package", nargs="*", help="all if none is named")
    options = parser.parse_args()
    packages = {p.parent.name: Package(p.parent) for p in sorted((ROOT / "src").glob("*/setup.py"))}
    needed = {name: with_its_own(packages[name], packages) for name in options.package or packages}
    failed = []
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(os.cpu_count()) as pool:
        checker = Checker(options.home, Path(folder))
        to_build = {each.name: each for ones in needed.values() for each in ones}
        wheels = dict(zip(to_build, pool.map(checker.build, to_build.values()), strict=True))
        checks = {name: pool.submit(checker.check, ones, wheels) for name, ones in needed.items()}
        for name, check in checks.items():
            error = check.exception()
            if error is None:
                text = f"all modules import, {check.result()} executables answer"
                print(f"{name}: {text}", flush=True)
            elif isinstance(error, RuntimeError):
                failed.append(name)
                print(f"{name}: {error}", file=sys.stderr)
            else:
                raise error
    if failed:
        print(f"error: failed with what they declare: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
