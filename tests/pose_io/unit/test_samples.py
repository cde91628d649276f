"""Samples of recordings of any kind."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from skeleton_bag import write_bag
from synthetic_body import extrinsics, kinematics, motion, skeleton_samples

from pose_core.errors import InputError
from pose_io.samples import read_samples

CSV = Path(__file__).parents[2] / "kinect_bridge" / "data" / "two_sensors.csv"


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    _, dof = motion(1.0)
    positions = kinematics().pose(dof).positions
    samples = skeleton_samples(positions, extrinsics(), np.random.default_rng(3), 0.005)
    path = tmp_path_factory.mktemp("bags") / "bag"
    write_bag(path, samples)
    return path, samples


def test_a_text_file_gives_all_sensors_skeletons_in_the_order_of_time():
    recorded = read_samples(CSV)
    stamps_ns = [sample.stamp_ns for sample in recorded.samples]
    assert recorded.sensors == ("left", "right")
    assert {sample.sensor for sample in recorded.samples} == {"left", "right"}
    assert stamps_ns == sorted(stamps_ns)


def test_a_bag_gives_what_was_written_into_it(bag):
    path, samples = bag
    recorded = read_samples(path)
    assert recorded.sensors == ("left", "right")
    assert [s.stamp_ns for s in recorded.samples] == [s.stamp_ns for s in samples]
    np.testing.assert_array_equal(recorded.samples[0].positions, samples[0].positions)


def test_a_bag_is_read_where_ros_is_not_installed(bag):
    """By the definitions that come with the package: no variable of ROS, none of its modules."""
    code = (
        "import sys; from pose_io.samples import read_samples; read_samples(sys.argv[1]);"
        "print([name for name in sys.modules if name.split('.')[0] in"
        " ('rclpy', 'ament_index_python', 'pose_msgs')])"
    )
    environment = {k: v for k, v in os.environ.items() if "AMENT" not in k and "ROS" not in k}
    done = subprocess.run(
        [sys.executable, "-c", code, str(bag[0])], capture_output=True, text=True, env=environment
    )
    assert done.stdout.strip() == "[]", done.stderr


def test_a_missing_file_is_named():
    with pytest.raises(InputError, match="found no file"):
        read_samples("nothing.csv")
