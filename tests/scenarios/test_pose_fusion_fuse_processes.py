"""``fuse`` is two processes: what becomes of one when the other is ended."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from patience import PATIENCE_S
from session_bag import write_session
from synthetic_body import extrinsics, kinematics, motion, skeleton_samples

WRITING = 3  # [threads] the main one, the bag's, the progress bar's
FUSE = "from pose_node.entry import start; start.pose_fusion.tools.fuse()"


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    _, dof = motion(20.0)
    positions = kinematics().pose(dof).positions
    samples = skeleton_samples(positions, extrinsics(), np.random.default_rng(3), 0.005)
    path = tmp_path_factory.mktemp("fuse") / "in"
    placed = {sensor: extrinsics().T_map_sensor(sensor) for sensor in ("left", "right")}
    write_session(path, samples, T_map_sensor=placed)
    return path


def children(pid):
    return list(map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text().split()))


def threads(pid):
    return len(list(Path(f"/proc/{pid}/task").iterdir()))


def is_running(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


@pytest.fixture
def fusing(bag, tmp_path):
    """The tool, and its child that stands still: neither can come to its end."""
    words = [sys.executable, "-c", FUSE, str(bag), str(tmp_path / "out")]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + PATIENCE_S

    def wait_for(has_come):
        while not has_come():
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.001)

    wait_for(lambda: children(process.pid))
    found = children(process.pid)
    os.kill(found[0], signal.SIGSTOP)
    wait_for(lambda: threads(process.pid) >= WRITING)
    yield process, found[0]
    for pid in (process.pid, found[0]):
        if is_running(pid):
            os.kill(pid, signal.SIGKILL)
    process.communicate()


def test_a_killed_estimator_gives_one_line_and_no_bag(fusing, tmp_path):
    process, child = fusing
    os.kill(child, signal.SIGKILL)
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    told = [line for line in errors.splitlines() if "error" in line]
    assert told == [
        "error: the process of the estimator was ended by SIGKILL, maybe for want of memory: "
        "close other programs and run again"
    ]
    assert "Traceback" not in errors
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_ends_both_without_a_word_and_leaves_nothing(fusing, tmp_path):
    process, child = fusing
    for pid in (process.pid, child):  # a terminal gives it to both
        os.kill(pid, signal.SIGINT)
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert "error" not in errors
    assert not is_running(child)
    assert list(tmp_path.iterdir()) == []


def test_an_estimator_whose_parent_is_killed_ends_too(fusing):
    process, child = fusing
    process.kill()
    process.wait()
    os.kill(child, signal.SIGCONT)
    deadline = time.monotonic() + PATIENCE_S
    while is_running(child):
        assert time.monotonic() < deadline
        time.sleep(0.01)
