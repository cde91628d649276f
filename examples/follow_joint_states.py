"""Follows a person's joint angles: `python examples/follow_joint_states.py [ID]`."""

import contextlib
import sys

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import String

STALE_S = 0.1  # [s] without a message, after which a robot had better stop
heard = []

rclpy.init()
node = rclpy.create_node("follower")
body = f"/humans/bodies/{sys.argv[1] if len(sys.argv) > 1 else 'subject'}"
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def on_angles(message):
    """Use one angle of a message."""
    heard.append(message.header.stamp)
    angles = dict(zip(message.name, message.position, strict=True))
    print(f"left_elbow_flexion {angles['left_elbow_flexion']:+.3f} rad", flush=True)


def check():
    """Say when nothing has come for too long."""
    if not heard:
        print("stale: stop", flush=True)
    heard.clear()


node.create_subscription(String, f"{body}/urdf", lambda m: print("urdf", len(m.data)), latched)
node.create_subscription(JointState, f"{body}/joint_states", on_angles, 10)
node.create_timer(STALE_S, check)
with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
    rclpy.spin(node)
