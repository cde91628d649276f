from pose_io.topics import unused_sensors

ARRAY = ["pose_msgs/msg/SkeletonArray"]


def test_an_unused_camera_is_reported():
    topics = [(f"/kinect_{name}/skeletons", ARRAY) for name in ("left", "right", "back")]

    assert unused_sensors(topics, ("left", "right"), "/") == ("back",)


def test_cameras_of_other_namespaces_are_ignored():
    topics = [
        ("/lab/kinect_back/skeletons", ARRAY),
        ("/kinect_side/skeletons", ["std_msgs/msg/String"]),
        ("/kinect_left/images", ARRAY),
    ]

    assert unused_sensors(topics, ("left",), "/") == ()
    assert unused_sensors(topics, ("left",), "/lab") == ("back",)
