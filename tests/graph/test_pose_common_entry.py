"""Executables that are interrupted while they still import."""

import signal
import sys

import pytest

pytestmark = pytest.mark.graph


@pytest.fixture
def slow(tmp_path, start_process):
    """An executable whose module takes long to import."""
    (tmp_path / "slow_tool.py").write_text(
        "import time\nprint('importing', flush=True)\ntime.sleep(60)\n"
    )
    code = "from pose_common.entry import start; start.slow_tool()"
    process = start_process(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {code}"]
    )
    process.wait_for_output("importing")
    return process


def test_ctrl_c_while_it_imports_ends_it_without_a_traceback(slow):
    slow.signal(signal.SIGINT)

    assert slow.wait() == 130
    assert slow.output == "importing\n"
