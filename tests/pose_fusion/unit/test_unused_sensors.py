from pose_fusion.unused_sensors import unused_sensors

ARRAY = ["pose_msgs/msg/SkeletonArray"]


def test_a_camera_that_is_there_and_not_used_is_named():
    topics = [(f"/kinect_{name}/skeletons", ARRAY) for name in ("left", "right", "back")]

    assert unused_sensors(topics, ("left", "right"), "/") == ("back",)


def test_cameras_of_other_namespaces_and_other_topics_are_no_matter():
    topics = [
        ("/lab/kinect_back/skeletons", ARRAY),
        ("/kinect_side/skeletons", ["std_msgs/msg/String"]),
        ("/kinect_left/images", ARRAY),
    ]

    assert unused_sensors(topics, ("left",), "/") == ()
    assert unused_sensors(topics, ("left",), "/lab") == ("back",)
