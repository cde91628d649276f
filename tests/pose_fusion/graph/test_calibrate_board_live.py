"""``./pose calibrate board --live``: from running cameras to a file (rendered images)."""

import itertools
import sys

import numpy as np
import pytest
from patience import PATIENCE_S
from rclpy.qos import qos_profile_sensor_data
from rendered_board import Scene, board_poses
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import CameraInfo, Image

from pose_calibration.board.camera import Camera
from pose_calibration.board.target import Board, BoardParameters
from pose_calibration.files.extrinsics_file import load_extrinsics
from pose_node.conversions import ns_to_stamp

pytestmark = [pytest.mark.graph, pytest.mark.xdist_group("live_graph")]

TOOL = [sys.executable, "-c", "from pose_fusion.tools.calibrate import main; main()", "board"]
BOARD = Board(BoardParameters(square=0.06))
SIZE = (480, 360)
K = np.array([[400.0, 0.0, 240.0], [0.0, 400.0, 180.0], [0.0, 0.0, 1.0]])
CAMERA = Camera(image_size=SIZE, K=K, distortion=np.zeros(5), source="rendered")
RIGHT = np.eye(4)
RIGHT[:3, :3] = Rotation.from_euler("y", -25.0, degrees=True).as_matrix()
RIGHT[:3, 3] = 0.7, 0.0, 0.2
PLACES = {"left": np.eye(4), "right": RIGHT}
LOOKS = 3  # at each place of the board, so that it is seen to stand still
BETWEEN_NS = 250_000_000


def looks():
    """Images by camera, with their stamps [ns]: the board held at places, again and again."""
    scene = Scene(BOARD, dict.fromkeys(PLACES, CAMERA), PLACES)
    rng = np.random.default_rng(8)
    poses = board_poses(BOARD, 28, rng, distance=1.5)
    pictures = [{name: scene.image(name, pose, rng) for name in PLACES} for pose in poses]
    stamp_ns = 10**9
    for images in itertools.cycle(pictures):
        for _ in range(LOOKS):
            stamp_ns += BETWEEN_NS
            yield stamp_ns, images


def image_message(stamp_ns, image):
    message = Image(
        width=SIZE[0], height=SIZE[1], encoding="mono8", step=SIZE[0], data=image.tobytes()
    )
    message.header.stamp = ns_to_stamp(stamp_ns)
    return message


def test_a_moved_board_is_calibrated_and_the_tool_ends(ros_context, start_process, tmp_path):
    output = tmp_path / "extrinsics.yaml"
    node = ros_context.make_node("cameras")
    images, infos = (
        {
            name: node.create_publisher(kind, f"kinect_{name}/{leaf}", qos_profile_sensor_data)
            for name in PLACES
        }
        for kind, leaf in ((Image, "image_raw"), (CameraInfo, "camera_info"))
    )
    tool = start_process([*TOOL, "--live", *PLACES, "-o", output, "--square", "0.06"])
    for publisher in (*images.values(), *infos.values()):
        ros_context.spin_until(publisher.get_subscription_count, what="the tool")
    shown = looks()

    def show_until_it_ends():
        stamp_ns, pictures = next(shown)
        for name, picture in pictures.items():
            infos[name].publish(
                CameraInfo(width=SIZE[0], height=SIZE[1], k=K.ravel().tolist(), d=[0.0] * 5)
            )
            images[name].publish(image_message(stamp_ns, picture))
        return tool.returncode is not None

    ros_context.spin_until(show_until_it_ends, 2 * PATIENCE_S, what="the tool's end")
    assert tool.returncode == 0, tool.output
    found = load_extrinsics(output).T_reference_sensor["right"]
    turn = Rotation.from_matrix(found[:3, :3].T @ RIGHT[:3, :3]).magnitude()
    assert np.degrees(turn) < 0.15
    assert np.linalg.norm(found[:3, 3] - RIGHT[:3, 3]) < 0.004
    assert "reprojection" in tool.output
