"""Executables that are interrupted while they still import."""

import signal
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.graph, pytest.mark.xdist_group("prepare")]
POSE = Path(__file__).resolve().parents[3] / "pose"


IMPORTS = {
    "python": "time.sleep(60)",
    # scipy's and others', made with Cython
    "compiled": """
try:
    time.sleep(60)
except KeyboardInterrupt:
    raise ImportError("initialization failed") from None
""",
}


@pytest.fixture(params=IMPORTS)
def slow(tmp_path, start_process, request):
    """An executable whose module takes long to import."""
    (tmp_path / "slow_tool.py").write_text(
        f"import time\nprint('importing', flush=True)\n{IMPORTS[request.param]}\n"
    )
    code = "from pose_node.entry import start; start.slow_tool()"
    process = start_process(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {code}"]
    )
    process.wait_for_output("importing")
    return process


def test_ctrl_c_during_imports_ends_an_executable_without_a_traceback(slow):
    slow.signal(signal.SIGINT)

    assert slow.wait() == 130
    assert slow.output == "importing\n"


def test_a_missing_module_is_reported(start_process):
    code = "from pose_node.entry import start; start.no_such_module()"
    process = start_process([sys.executable, "-c", code])

    assert process.wait() == 1
    assert "No module named 'no_such_module'" in process.output


def test_ctrl_c_while_python_itself_starts_waits_for_the_executable(start_process):
    """As ``./pose`` starts it: SIGINT is blocked until then."""
    waiting = (
        "import signal, time\n"
        "print('starting', flush=True)\n"
        "while signal.SIGINT not in signal.sigpending():\n    time.sleep(0.01)\n"
        "from pose_node.entry import start; start.a_module_that_is_not_there()\n"
    )
    process = start_process(["env", "--block-signal=INT", sys.executable, "-c", waiting])
    process.wait_for_output("starting")

    process.signal(signal.SIGINT)

    assert process.wait() == 130
    assert process.output == "starting\n"


def test_an_executable_ends_on_ctrl_c(start_process, tmp_path):
    process = start_process([POSE, "run", "pose_fusion", "recorder", "-o", tmp_path / "bag"])
    process.wait_for_output("recording every topic")

    process.signal(signal.SIGINT)

    assert process.wait() == 0
