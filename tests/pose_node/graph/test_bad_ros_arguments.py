"""Arguments that ROS itself refuses end a node with one line."""

import os
import subprocess
import sys

import pytest
from patience import PATIENCE_S


@pytest.mark.parametrize(
    "arguments",
    [
        ["--params-file", "missing.yaml"],
        ["--params-file", "broken.yaml"],
        ["-p", "rate"],
        ["-r", "__node:=a b"],
    ],
)
def test_bad_ros_arguments_end_a_node_with_one_line(tmp_path, ros_domain_id, arguments):
    (tmp_path / "broken.yaml").write_text("{[")
    node = "from pose_fusion.nodes.fusion import main; main()"
    ended = subprocess.run(
        [sys.executable, "-c", node, "--ros-args", *arguments],
        cwd=tmp_path,
        env=os.environ | {"ROS_DOMAIN_ID": str(ros_domain_id)},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert ended.returncode == 1
    *of_rcl, line = ended.stderr.splitlines()
    assert line.startswith("error: ")
    assert arguments[1] in line
    assert not [other for other in of_rcl if "[rcl]" not in other], "its own log, no traceback"
