"""A node that ends leaves nothing in shared memory."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from patience import PATIENCE_S

SHARED = Path("/dev/shm")


@pytest.mark.skipif(not SHARED.is_dir(), reason="no shared memory in the file system")
def test_a_node_that_is_interrupted_leaves_no_segment_in_shared_memory(tmp_path, ros_domain_id):
    others = set(SHARED.glob("fastrtps_*"))  # which a node opens, too, if it discovers their owners
    node = "from pose_fusion.nodes.recorder import main; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", node, "--ros-args", "-p", "start_paused:=true"],
        cwd=tmp_path,
        env=os.environ | {"ROS_DOMAIN_ID": str(ros_domain_id)},
    )
    maps = Path(f"/proc/{process.pid}/maps")
    end_s = time.monotonic() + PATIENCE_S
    segments = set()
    while not segments and time.monotonic() < end_s:
        time.sleep(0.1)
        paths = {line.split()[-1] for line in maps.read_text().splitlines()}
        segments = {Path(path) for path in paths if path.startswith(f"{SHARED}/fastrtps_")}
        segments = {path for path in segments if "port" not in path.name} - others
    assert segments, "the node has a participant"
    time.sleep(1.0)  # until it spins
    process.send_signal(signal.SIGINT)
    assert process.wait(PATIENCE_S) == 0
    assert not [path for path in segments if path.exists()]
