"""The harness itself: nodes of a test talk on a domain of their own."""

import os

from std_msgs.msg import String


def test_messages_stay_on_the_modules_ros_domain(ros_context, spin_until, ros_domain_id):
    assert os.environ["ROS_DOMAIN_ID"] == str(ros_domain_id)
    received = ros_context.collect(String, "greeting")
    publisher = ros_context.make_node().create_publisher(String, "greeting", 10)

    spin_until(lambda: publisher.get_subscription_count() == 1, what="the subscription")
    publisher.publish(String(data="hello"))
    spin_until(lambda: received, what="the message")

    assert received == [String(data="hello")]
