"""Live images for the calibration with a board (rendered)."""

import cv2
import numpy as np
from rendered_board import Scene, board_pose
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from pose_calibration.board.camera import Camera
from pose_calibration.board.collecting import BoardCollector
from pose_calibration.board.target import Board, BoardParameters
from pose_fusion.nodes.board_images import BoardImagesNode
from pose_node.conversions import ns_to_stamp

BOARD = Board(BoardParameters(square=0.06))
K = np.array([[400.0, 0.0, 240.0], [0.0, 400.0, 180.0], [0.0, 0.0, 1.0]])
CAMERA = Camera(image_size=(480, 360), K=K, distortion=np.zeros(5), source="rendered")
TOPICS = {"left": "kinect_left/image_raw", "right": "kinect_right/image_raw"}
INFOS = {"left": "kinect_left/camera_info", "right": "kinect_right/camera_info"}


def test_raw_and_compressed_images_and_infos_reach_the_collector(ros_context):
    places = {"left": np.eye(4), "right": np.eye(4)}
    scene = Scene(BOARD, dict.fromkeys(places, CAMERA), places)
    collector = BoardCollector(BOARD, list(TOPICS), max_skew_s=0.1)
    node = ros_context.add(BoardImagesNode(collector, TOPICS, INFOS))
    tester = ros_context.make_node("cameras")
    raw = tester.create_publisher(Image, TOPICS["left"], 10)
    packed = tester.create_publisher(CompressedImage, f"{TOPICS['right']}/compressed", 10)
    info = tester.create_publisher(CameraInfo, INFOS["left"], 10)
    for publisher in (raw, packed, info):
        ros_context.spin_until(publisher.get_subscription_count, what="the node")
    info.publish(CameraInfo(width=480, height=360, k=K.ravel().tolist(), d=[0.0] * 5))
    image = scene.image("left", board_pose(BOARD, 0, 0, 1.2), np.random.default_rng(0))
    data = cv2.imencode(".png", image)[1].tobytes()
    for look in (0, 1):
        stamp = ns_to_stamp(10**9 + look * 300_000_000)
        left = Image(height=360, width=480, encoding="mono8", step=480, data=image.tobytes())
        right = CompressedImage(format="png", data=data)
        left.header.stamp = right.header.stamp = stamp
        raw.publish(left)
        packed.publish(right)
        ros_context.spin_until(
            lambda n=2 * (look + 1): collector.counters["images"] == n, what="the images"
        )
    assert len(collector.instants) == 1
    ros_context.spin_until(lambda: "left" in node.cameras, what="the camera info")


def test_an_unreadable_image_is_reported(ros_context):
    collector = BoardCollector(BOARD, list(TOPICS), max_skew_s=0.1)
    node = ros_context.add(BoardImagesNode(collector, TOPICS, INFOS))
    publisher = ros_context.make_node("cameras").create_publisher(Image, TOPICS["left"], 10)
    ros_context.spin_until(publisher.get_subscription_count, what="the node")
    publisher.publish(Image(height=1, width=1, encoding="bayer_rggb8", step=1, data=b"1"))
    ros_context.spin_until(lambda: "bayer_rggb8" in node.malformed, what="the complaint")
