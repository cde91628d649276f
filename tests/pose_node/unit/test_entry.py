import re
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from pose_node.entry import start

SRC = Path(__file__).resolve().parents[3] / "src"
SETUPS = [path for path in sorted(SRC.glob("*/setup.py")) if "console_scripts" in path.read_text()]


def entry_points(setup):
    return re.findall(r'"(\w+) = ([\w.:]+)"', setup.read_text())


@pytest.mark.parametrize("setup", SETUPS, ids=[setup.parent.name for setup in SETUPS])
def test_every_executable_starts_so_that_ctrl_c_is_quiet(setup):
    assert entry_points(setup)
    for name, target in entry_points(setup):
        assert target.startswith("pose_node.entry:start."), name
        module = target.removeprefix("pose_node.entry:start.")
        spec = find_spec(module)
        assert spec is not None, f"{name}: no module {module}"
        assert "\ndef main() -> None:" in Path(spec.origin).read_text(), module


def test_an_executable_runs_main_and_returns_its_exit_code(tmp_path, monkeypatch):
    (tmp_path / "a_tool.py").write_text("import sys\ndef main() -> None:\n    sys.exit(7)\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(SystemExit) as ending:
        start.a_tool()
    assert ending.value.code == 7
    assert "a_tool" in sys.modules


def test_a_missing_package_is_reported_in_one_line_with_a_remedy(tmp_path, monkeypatch):
    (tmp_path / "needy_tool.py").write_text("import no_such_package_anywhere.part\n")
    monkeypatch.syspath_prepend(tmp_path)

    with pytest.raises(SystemExit) as ending:
        start.needy_tool()

    assert ending.value.code == (
        "error: found no Python package 'no_such_package_anywhere', which needy_tool needs: "
        "install it, for example with 'python3 -m pip install no_such_package_anywhere'"
    )


def test_the_entry_point_imports_no_heavy_library():
    text = (SRC / "pose_node" / "pose_node" / "entry.py").read_text()
    imported = re.findall(r"^(?:import|from) (\S+)", text, re.MULTILINE)
    assert imported == ["atexit", "os", "signal", "sys", "importlib"]
