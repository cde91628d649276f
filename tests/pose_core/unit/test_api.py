"""The core's door: what it offers, and that opening it changes nothing."""

import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

import pose_core
from pose_core import api

SRC = Path(__file__).parents[3] / "src"
STATE = """
import locale, logging, os, pkgutil, random, signal, sys, warnings
import numba, numpy

def state():
    return (
        numba.config.CACHE_DIR,
        dict(os.environ),
        numpy.geterr(),
        numpy.get_printoptions(),
        numpy.random.get_state()[1].tolist(),
        random.getstate(),
        list(warnings.filters),
        [signal.getsignal(number) for number in signal.valid_signals()],
        logging.getLogger().level,
        list(logging.getLogger().handlers),
        locale.setlocale(locale.LC_ALL),
        list(sys.path),
        os.getcwd(),
    )

import scipy.linalg, scipy.spatial.transform  # theirs, not ours
before = state()
import pose_core
for module in pkgutil.walk_packages(pose_core.__path__, "pose_core."):
    __import__(module.name)
assert state() == before
"""
LIGHT = (
    "arrays",
    "atomic_file",
    "counters",
    "errors",
    "finite_numbers",
    "joints",
    "lower_line",
    "parameters",
    "plain_yaml",
    "stamps",
)


def run(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)


def test_importing_the_core_changes_no_global_state():
    done = run(STATE)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", LIGHT)
def test_light_modules_load_neither_numba_nor_scipy(name):
    done = run(f"import sys, pose_core.{name}; print({{'numba', 'scipy'}} & set(sys.modules))")
    assert done.stdout.strip() == "set()", done.stderr


def test_an_estimator_whose_library_is_missing_says_how_to_get_it(monkeypatch):
    monkeypatch.setattr("pose_core.estimators.li2020.find_spec", lambda name: None)
    with pytest.raises(api.ParameterError, match=r"pip install 'pose_core\[li2020\]'"):
        api.Pipeline(api.PipelineParameters(estimator="li2020"))


def test_all_descriptions_of_a_package_have_the_same_version():
    versions = {
        ElementTree.parse(path).getroot().findtext("version") for path in SRC.glob("*/package.xml")
    }
    for path in SRC.glob("*/pyproject.toml"):
        versions |= set(re.findall(r'^version = "(.*)"', path.read_text(), re.MULTILINE))
    assert versions == {pose_core.__version__}
