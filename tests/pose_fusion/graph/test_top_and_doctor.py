"""``top`` and ``doctor`` as processes."""

import json
import os
import pty
import signal
import subprocess
import sys

import pytest
from patience import PATIENCE_S

pytestmark = pytest.mark.graph

TOP = [sys.executable, "-c", "from pose_fusion.nodes.top import main; main()"]
DOCTOR = [sys.executable, "-c", "from pose_fusion.tools.doctor import main; main()"]


def test_top_once_prints_one_page_and_ends(start_process):
    process = start_process([*TOP, "--once", "--listen", "0.5"])

    assert process.wait() == 0
    assert process.output.startswith("pose top")
    assert "no messages yet: try ./pose doctor" in process.output


def test_top_ends_on_ctrl_c_and_restores_the_terminal(ros_domain_id):
    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "80", "LINES": "24"}
    process = subprocess.Popen(
        TOP, stdin=theirs, stdout=theirs, stderr=theirs, env=environment, start_new_session=True
    )
    os.close(theirs)
    output = b""
    try:
        while b"pose top" not in output:
            output += os.read(ours, 65536)
        process.send_signal(signal.SIGINT)
        while True:
            try:
                part = os.read(ours, 65536)
            except OSError:  # the terminal has lost its last user
                break
            if not part:
                break
            output += part
        assert process.wait(PATIENCE_S) == 0
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
        os.close(ours)
    assert b"Traceback" not in output
    assert output.rindex(b"\x1b[?1049l") > output.rindex(b"\x1b[?1049h")  # the normal screen


def test_doctor_reports_every_check_as_json(start_process):
    process = start_process([*DOCTOR, "--json", "--listen", "3"])

    code = process.wait()

    content = json.loads(process.output)
    assert code == (1 if content["wrong"] else 0)
    assert {finding["area"] for finding in content["findings"]} == {"machine", "graph", "devices"}
    messages = next(f for f in content["findings"] if f["subject"] == "messages")
    assert messages["verdict"] == "ok"


@pytest.mark.parametrize("command", [TOP, DOCTOR])
def test_an_invalid_option_is_reported(start_process, command):
    process = start_process([*command, "--listen", "-1"])

    assert process.wait() == 2
    assert "--listen: -1 s is outside" in process.output
