"""Each source that is a topic, with a real publisher of the same messages."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point, Pose, TransformStamped
from pose_msgs.msg import SkeletonArray
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from kinect_bridge.nodes.kinect_bridge import KinectBridge
from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, JOINTS
from pose_core.stamps import NS_PER_S, nanoseconds
from pose_io.recordings.joint_map_files import shipped_joint_map
from pose_node.conversions import ns_to_stamp

LEFT_ELBOW = (0.3, -0.1, 2.5)  # [m] in the optical frame, of the person below


def facing_person(x: float = 0.0) -> dict[str, tuple[float, float, float]]:
    """Where our joints are, in the optical frame [m]."""
    middle = {"head": (0, -0.6), "neck": (0, -0.4), "torso": (0, -0.1)}
    limbs = {
        "shoulder": (0.2, -0.35),
        "elbow": (0.3, -0.1),
        "hand": (0.3, 0.2),
        "hip": (0.1, 0.15),
        "knee": (0.1, 0.55),
        "foot": (0.1, 0.95),
    }
    places = {}
    for name in JOINTS:
        side, _, joint = name.partition("_")
        px, py = middle.get(name) or limbs[joint]
        places[name] = (x + (px if side == "left" else -px), py, 2.5)
    return places


def as_source_gives_it(map_name: str, x: float = 0.0) -> np.ndarray:
    """The person in a source's joints, axes and unit; joints that no map uses are NaN."""
    joint_map = shipped_joint_map(map_name)
    joints = np.full((len(joint_map.joints), 3), np.nan)
    for ours, place in facing_person(x).items():
        for theirs in joint_map.sources[ours]:
            joints[joint_map.index[theirs]] = joint_map.R_optical_sdk.T @ place / joint_map.unit_m
    return joints


@pytest.fixture
def bridge(ros_context, spin_until):
    """Start a bridge with a source, and a publisher that it hears."""

    def start(message_type, hears, **parameters):
        node = ros_context.make_node()
        received, diagnostics = [], []
        node.create_subscription(
            SkeletonArray, "kinect_left/skeletons", received.append, qos_profile_sensor_data
        )
        node.create_subscription(DiagnosticArray, "/diagnostics", diagnostics.append, 10)
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        ros_context.add(KinectBridge(parameter_overrides=overrides))
        publisher = node.create_publisher(message_type, hears, 10)
        spin_until(
            lambda: (
                publisher.get_subscription_count()
                and node.count_publishers("kinect_left/skeletons")
            ),
            what="bridge and publisher to find each other",
        )

        def send(message):
            """Publish until the bridge has answered with one more message."""
            before = len(received)
            publisher.publish(message)
            spin_until(lambda: len(received) > before, what="a frame")
            return received[-1]

        def counts():
            diagnostics.clear()
            spin_until(lambda: diagnostics, what="a report")
            return {value.key: value.value for value in diagnostics[-1].status[0].values}

        return SimpleNamespace(
            send=send,
            counts=counts,
            publisher=publisher,
            received=received,
            now_ns=lambda: node.get_clock().now().nanoseconds,
        )

    return start


def place(skeleton, joint: str) -> tuple[float, float, float]:
    position = skeleton.position[JOINT_INDEX[joint]]
    return position.x, position.y, position.z


def check_person(skeleton, x: float = 0.0, atol: float = 1e-6) -> None:
    for joint, expected in facing_person(x).items():
        np.testing.assert_allclose(place(skeleton, joint), expected, atol=atol, err_msg=joint)


def markers(stamp, bodies: dict[int, np.ndarray]) -> MarkerArray:
    message = MarkerArray()
    for body, joints in bodies.items():
        for joint, (x, y, z) in enumerate(joints.tolist()):
            marker = Marker(id=100 * body + joint)
            marker.header.stamp = stamp
            marker.pose.position = Point(x=x, y=y, z=z)
            message.markers.append(marker)
    return message


def test_markers_of_two_people_become_two_skeletons_with_their_stamp(bridge):
    heard = bridge(MarkerArray, "body_tracking_data", source="markers")
    stamp_ns = heard.now_ns()
    bodies = {
        1: as_source_gives_it("azure_kinect_ros"),
        7: as_source_gives_it("azure_kinect_ros", 1.0),
    }

    message = heard.send(markers(ns_to_stamp(stamp_ns), bodies))

    assert nanoseconds(message.header.stamp) == stamp_ns
    assert message.header.frame_id == "kinect_left_optical_frame"
    assert [skeleton.id for skeleton in message.skeletons] == ["1", "7"]
    check_person(message.skeletons[0])
    check_person(message.skeletons[1], 1.0)
    assert set(message.skeletons[0].tracking_state) == {2}


def test_empty_markers_are_a_frame_without_persons(bridge):
    heard = bridge(MarkerArray, "tracker/bodies", source="markers", topic="tracker/bodies")

    message = heard.send(MarkerArray())

    assert message.skeletons == []
    assert abs(nanoseconds(message.header.stamp) - heard.now_ns()) < 10 * NS_PER_S


def test_markers_that_are_no_joints_and_places_that_are_no_numbers_are_counted(bridge):
    heard = bridge(MarkerArray, "body_tracking_data", source="markers")
    joints = as_source_gives_it("azure_kinect_ros")
    elbow = shipped_joint_map("azure_kinect_ros").index["ELBOW_LEFT"]
    joints[elbow] = 1e30, 0.0, 0.0
    message = markers(ns_to_stamp(heard.now_ns()), {1: joints})
    message.markers.append(Marker(id=190))
    message.markers.append(Marker(id=-5))
    message.markers.append(message.markers[elbow])

    (skeleton,) = heard.send(message).skeletons

    assert skeleton.tracking_state[JOINT_INDEX["left_elbow"]] == 0
    assert math.isnan(place(skeleton, "left_elbow")[0])
    counts = heard.counts()
    assert counts["markers_unknown"] == "2"
    assert counts["markers_repeated"] == "1"
    assert counts["joints_out_of_range"] == "1"
    assert counts["frames_received"] == "1"


def test_a_frame_that_comes_again_is_left_out_and_counted(bridge):
    heard = bridge(MarkerArray, "body_tracking_data", source="markers")
    body = {1: as_source_gives_it("azure_kinect_ros")}
    stamp_ns = heard.now_ns()
    heard.send(markers(ns_to_stamp(stamp_ns), body))

    heard.publisher.publish(markers(ns_to_stamp(stamp_ns), body))
    heard.publisher.publish(markers(ns_to_stamp(stamp_ns - 10_000_000), body))
    heard.send(markers(ns_to_stamp(stamp_ns + 33_000_000), body))

    counts = heard.counts()
    assert counts["frames_repeated"] == "1"
    assert counts["frames_out_of_order"] == "1"
    assert counts["frames_published"] == "2"


def zed_object(label_id, body_format, joints, tracking_state=1, confidence=None):
    from zed_msgs.msg import Object

    each = Object(
        label_id=label_id,
        body_format=body_format,
        tracking_state=tracking_state,
        skeleton_available=True,
    )
    for keypoint, joint in zip(each.skeleton_3d.keypoints, joints, strict=False):
        keypoint.kp = np.asarray(joint, dtype=np.float32)
    values = np.full(70, 90.0, dtype=np.float32)
    if confidence is not None:
        values[: len(confidence)] = confidence
    each.skeleton_keypoint_confidence = values
    return each


@pytest.mark.parametrize(("body_format", "name"), [(0, "zed_18"), (1, "zed_34"), (2, "zed_38")])
def test_zed_skeletons_of_each_body_format_are_understood(bridge, body_format, name):
    from zed_msgs.msg import ObjectsStamped

    heard = bridge(ObjectsStamped, "bodies", source="zed", topic="bodies")
    joints = as_source_gives_it(name)
    if name == "zed_18":  # neck and hips stand for the torso too
        joints = as_source_gives_it(name)
        joint_map = shipped_joint_map(name)
        for ours in ("neck", "left_hip", "right_hip"):
            (theirs,) = joint_map.sources[ours]
            place_ = np.array(facing_person()[ours])
            joints[joint_map.index[theirs]] = joint_map.R_optical_sdk.T @ place_
    message = ObjectsStamped(objects=[zed_object(3, body_format, joints)])
    stamp_ns = heard.now_ns()
    message.header.stamp = ns_to_stamp(stamp_ns)

    answer = heard.send(message)

    assert nanoseconds(answer.header.stamp) == stamp_ns
    (skeleton,) = answer.skeletons
    assert skeleton.id == "3"
    for joint, expected in facing_person().items():
        if joint != "torso":
            np.testing.assert_allclose(place(skeleton, joint), expected, atol=1e-6)
    assert place(skeleton, "torso") == pytest.approx((0.0, -0.1, 2.5), abs=0.05)


def test_a_zed_person_that_is_searched_for_is_inferred_and_doubtful_joints_too(bridge):
    from zed_msgs.msg import ObjectsStamped

    heard = bridge(ObjectsStamped, "bodies", source="zed", topic="bodies")
    joints = as_source_gives_it("zed_38")
    confidence = np.full(38, 90.0)
    confidence[shipped_joint_map("zed_38").index["LEFT_ELBOW"]] = 20.0
    off = zed_object(5, 2, joints, tracking_state=0)
    unknown = zed_object(6, 3, joints)
    message = ObjectsStamped(
        objects=[
            zed_object(3, 2, joints, confidence=confidence),
            zed_object(4, 2, joints, tracking_state=2),
            off,
            unknown,
        ]
    )
    message.header.stamp = ns_to_stamp(heard.now_ns())

    seen, searched = heard.send(message).skeletons

    assert seen.tracking_state[JOINT_INDEX["left_elbow"]] == 1
    assert seen.tracking_state[JOINT_INDEX["right_elbow"]] == 2
    assert set(searched.tracking_state) == {1}
    counts = heard.counts()
    assert counts["objects_without_skeleton"] == "1"
    assert counts["objects_unknown_format"] == "1"


def test_hiros_markers_are_identified_by_id_or_name_and_their_confidence_is_used(bridge):
    from hiros_skeleton_msgs.msg import Marker as HirosMarker, Skeleton, SkeletonGroup

    heard = bridge(SkeletonGroup, "skeleton_group", source="hiros")
    index = shipped_joint_map("hiros").index
    skeleton = Skeleton(id=2)
    stamp_ns = heard.now_ns()
    skeleton.src_time = ns_to_stamp(stamp_ns)
    for joint, (x, y, z) in enumerate(as_source_gives_it("hiros").tolist()):
        marker = HirosMarker(id=joint, confidence=1.0)
        if joint == index["ELBOW_LEFT"]:
            marker = HirosMarker(id=-1, name="ELBOW_LEFT", confidence=0.2)
        marker.center.pose.position = Point(x=x, y=y, z=z)
        skeleton.markers.append(marker)
    skeleton.markers.append(HirosMarker(id=77))

    answer = heard.send(SkeletonGroup(skeletons=[skeleton]))

    assert nanoseconds(answer.header.stamp) == stamp_ns
    (person,) = answer.skeletons
    check_person(person)
    assert person.tracking_state[JOINT_INDEX["left_elbow"]] == 1
    assert person.tracking_state[JOINT_INDEX["right_elbow"]] == 2
    assert heard.counts()["markers_unknown"] == "1"


def test_named_poses_are_one_person_and_invalid_ones_are_missing(bridge):
    from teleop_ros2_interfaces.msg import NamedPoseArray

    heard = bridge(NamedPoseArray, "xr_teleop/full_body", source="named_poses")
    joint_map = shipped_joint_map("smpl_24")
    joints = np.nan_to_num(as_source_gives_it("smpl_24"))
    message = NamedPoseArray(
        name=[*joint_map.joints, "tail"],
        pose=[Pose(position=Point(x=x, y=y, z=z)) for x, y, z in [*joints.tolist(), (0.0,) * 3]],
        is_valid=[name != "left_elbow" for name in [*joint_map.joints, "tail"]],
    )
    message.header.stamp = ns_to_stamp(heard.now_ns())

    (person,) = heard.send(message).skeletons

    assert person.tracking_state[JOINT_INDEX["left_elbow"]] == 0
    assert place(person, "right_elbow") == pytest.approx(facing_person()["right_elbow"])
    assert heard.counts()["poses_unknown"] == "1"


def test_named_poses_of_uneven_length_are_left_out_and_counted(bridge):
    from teleop_ros2_interfaces.msg import NamedPoseArray

    heard = bridge(NamedPoseArray, "xr_teleop/full_body", source="named_poses")
    heard.publisher.publish(NamedPoseArray(name=["head", "neck"], pose=[Pose()], is_valid=[True]))

    message = NamedPoseArray()
    assert heard.send(message).skeletons == []

    assert heard.counts()["messages_uneven"] == "1"


def transform(child: str, parent: str, xyz, stamp, rotation=(0.0, 0.0, 0.0, 1.0)):
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id, message.header.stamp = parent, stamp
    t, r = message.transform.translation, message.transform.rotation
    t.x, t.y, t.z = map(float, xyz)
    r.x, r.y, r.z, r.w = rotation
    return message


def person_frames(stamp, person="1", root="openni_depth_frame", x=0.0):
    joint_map = shipped_joint_map("openni_tf")
    joints = as_source_gives_it("openni_tf", x)
    return [
        transform(f"{name}_{person}", root, joints[i], stamp)
        for i, name in enumerate(joint_map.joints)
    ]


def test_joint_frames_on_tf_become_a_skeleton_though_they_come_one_by_one(bridge):
    heard = bridge(TFMessage, "/tf", source="tf")
    stamp_ns = heard.now_ns()
    frames = person_frames(ns_to_stamp(stamp_ns))

    for each in frames[:-1]:
        heard.publisher.publish(TFMessage(transforms=[each]))
    answer = heard.send(TFMessage(transforms=[frames[-1]]))

    assert nanoseconds(answer.header.stamp) == stamp_ns
    assert [skeleton.id for skeleton in answer.skeletons] == ["1"]
    check_person(answer.skeletons[0])


def test_frames_that_hang_from_each_other_are_composed_up_to_the_sensor(bridge):
    heard = bridge(TFMessage, "/tf", source="tf", tf_root="camera")
    stamp = ns_to_stamp(heard.now_ns())
    joints = dict(
        zip(shipped_joint_map("openni_tf").joints, as_source_gives_it("openni_tf"), strict=True)
    )
    # The base turns by 90 degrees about z; the elbow hangs from the shoulder.
    half = math.sqrt(0.5)
    R_camera_base = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    base = transform("base", "camera", (1.0, 0.0, 0.0), stamp, (0.0, 0.0, half, half))
    in_base = {name: R_camera_base.T @ (p - [1.0, 0.0, 0.0]) for name, p in joints.items()}
    frames = [base]
    for name, p in in_base.items():
        if name == "left_elbow":
            frames.append(
                transform("left_elbow_1", "left_shoulder_1", p - in_base["left_shoulder"], stamp)
            )
        else:
            frames.append(transform(f"{name}_1", "base", p, stamp))

    (person,) = heard.send(TFMessage(transforms=frames)).skeletons

    check_person(person)


def test_a_cycle_without_all_joints_is_a_frame_once_it_begins_anew(bridge):
    heard = bridge(TFMessage, "/tf", source="tf")
    stamp_ns = heard.now_ns()
    frames = person_frames(ns_to_stamp(stamp_ns))
    bad = transform("head_1", "openni_depth_frame", (math.nan, 0, 0), ns_to_stamp(stamp_ns))
    heard.publisher.publish(TFMessage(transforms=[*frames[1:], bad]))

    answer = heard.send(TFMessage(transforms=person_frames(ns_to_stamp(stamp_ns + 1))[1:2]))

    (person,) = answer.skeletons
    assert person.tracking_state[JOINT_INDEX["head"]] == 0
    assert place(person, "neck") == pytest.approx(facing_person()["neck"])
    counts = heard.counts()
    assert counts["cycles_incomplete"] == "1"
    assert counts["transforms_not_finite"] == "1"


def test_stamps_of_another_host_s_clock_are_mapped_and_counted(bridge):
    heard = bridge(MarkerArray, "body_tracking_data", source="markers")
    body = {1: as_source_gives_it("azure_kinect_ros")}
    other_ns = heard.now_ns() - 3600 * NS_PER_S

    message = heard.send(markers(ns_to_stamp(other_ns), body))

    assert abs(heard.now_ns() - nanoseconds(message.header.stamp)) < 60 * NS_PER_S
    assert heard.counts()["stamps_mapped"] == "1"


def test_a_missing_message_package_is_one_line_with_instructions(ros_context):
    overrides = [
        Parameter("source", value="named_poses"),
        Parameter("message_type", value="no_such_package/msg/Poses"),
    ]
    with pytest.raises(InputError, match="no_such_package/msg/Poses is not installed"):
        KinectBridge(parameter_overrides=overrides)


def test_own_joint_maps_are_used(bridge, tmp_path):
    own = tmp_path / "swapped.yaml"
    own.write_text(
        "like: azure_kinect_ros\nmap: {left_elbow: ELBOW_RIGHT, right_elbow: ELBOW_LEFT}\n"
    )
    heard = bridge(MarkerArray, "body_tracking_data", source="markers", joint_map=str(own))
    body = {1: as_source_gives_it("azure_kinect_ros")}

    (person,) = heard.send(markers(ns_to_stamp(heard.now_ns()), body)).skeletons

    assert place(person, "left_elbow") == pytest.approx(facing_person()["right_elbow"])
