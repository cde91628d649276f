"""A person whose arms move, as the fusion publishes one: urdf, joint states, estimates, frames."""

import time

import numpy as np
from followed_person import person_urdf, waving
from pose_msgs.msg import PoseEstimate
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, String

from pose_core.api import load_body_model
from pose_node.conversions import ns_to_stamp

SUBJECT = "humans/bodies/subject"


class StreamedPerson:
    """Publishes with a node of the test's, whenever it is told to.

    Attributes:
        angles: What the arms do: the four angles [rad] at a time [s].
    """

    def __init__(self, node):
        self._node = node
        self.names = list(load_body_model("default").angle_names)
        self.angles, self.stddev = waving, 0.02
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._urdf = node.create_publisher(String, f"{SUBJECT}/urdf", latched)
        self._states = node.create_publisher(JointState, f"{SUBJECT}/joint_states", 10)
        self._estimates = node.create_publisher(PoseEstimate, f"{SUBJECT}/estimate", 10)
        self._dead_man = node.create_publisher(Bool, "dead_man", 10)
        self._urdf.publish(String(data=person_urdf()))
        self._begun = time.monotonic()

    def hold(self, held=True):
        self._dead_man.publish(Bool(data=held))

    def publish(self, offset_s=0.0):
        """Where the person is now; stamps are ahead of the clock by the offset."""
        t = time.monotonic() - self._begun
        moved = dict.fromkeys(self.names, 0.0)
        rates = dict.fromkeys(self.names, 0.0)
        for side in ("left", "right"):
            arm = [f"{side}_shoulder_{each}" for each in ("flexion", "abduction", "rotation")]
            arm.append(f"{side}_elbow_flexion")
            speed = (self.angles(t + 1e-4) - self.angles(t - 1e-4)) / 2e-4
            moved.update(zip(arm, self.angles(t).tolist(), strict=True))
            rates.update(zip(arm, np.nan_to_num(speed).tolist(), strict=True))
        now_ns = self._node.get_clock().now().nanoseconds
        stamp = ns_to_stamp(now_ns + round(offset_s * 1e9))
        position, velocity = list(moved.values()), list(rates.values())
        message = PoseEstimate(id="subject", name=self.names, position=position)
        message.velocity, message.position_stddev = velocity, [self.stddev] * len(position)
        message.header.stamp = stamp
        self._estimates.publish(message)
        state = JointState(name=self.names, position=position, velocity=velocity)
        state.header.stamp = stamp
        self._states.publish(state)
