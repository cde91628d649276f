"""Messages stored as bytes until they are drawn."""

import pytest
from geometry_msgs.msg import TransformStamped
from rclpy.serialization import serialize_message
from std_msgs.msg import Header, String
from tf2_msgs.msg import TFMessage

from pose_view.nodes.newest import Newest, first_child


def transform(parent, child):
    return TransformStamped(header=Header(frame_id=parent), child_frame_id=child)


@pytest.mark.parametrize("parent", ["map", "world", "odom_1", ""])
def test_the_first_child_frame_is_found_in_the_bytes(parent):
    message = TFMessage(transforms=[transform(parent, "body_subject"), transform("a", "b")])
    assert first_child(serialize_message(message)) == "body_subject"


def test_a_message_without_transforms_has_no_child():
    assert first_child(serialize_message(TFMessage())) == ""


def test_only_the_newest_of_each_kind_is_decoded_in_the_order_of_their_keys():
    newest, taken = Newest(), []

    def take(message):
        taken.append(message.data)

    for key, text in (("b", "old"), ("a", "first"), ("b", "new")):
        newest.put(key, String, serialize_message(String(data=text)), take)
    newest.hand_over()
    assert taken == ["first", "new"]
    newest.hand_over()
    assert taken == ["first", "new"]
