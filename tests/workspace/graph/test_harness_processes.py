"""The harness itself: a process that a test starts is found, stopped and reported."""

import signal
import sys

import pytest

pytestmark = pytest.mark.graph

GRANDCHILD = (
    "import subprocess, sys;"
    "subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)'],"
    " start_new_session=True); print('started')"
)


def test_a_process_is_interrupted_and_its_output_kept(start_process):
    process = start_process(
        [sys.executable, "-c", "print('ready', flush=True)\nimport signal; signal.pause()"]
    )
    process.wait_for_output("^ready$")

    assert process.stop() == -signal.SIGINT


def test_an_orphaned_process_in_another_session_is_terminated(start_process):
    process = start_process([sys.executable, "-c", GRANDCHILD])
    assert process.wait() == 0

    assert len(start_process.living()) == 1
    complaints = start_process.close(orphans_s=0.5)

    assert len(complaints) == 1
    assert "left running" in complaints[0]
    assert start_process.living() == []


def test_an_early_end_is_reported_with_the_output(start_process):
    process = start_process([sys.executable, "-c", "print('only this')"])

    with pytest.raises(AssertionError, match="only this"):
        process.wait_for_output("something else")
