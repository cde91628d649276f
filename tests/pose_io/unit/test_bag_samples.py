import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, JOINTS
from pose_core.streams.samples import ImuBlock, SkeletonSample
from pose_io.bag_samples import (
    BagFrames,
    BagSamples,
    read_body_series,
    read_estimates,
    read_extrinsics,
    read_sensor_series,
)
from pose_io.bag_writer import BagWriter
from pose_io.bags import open_bag
from pose_io.topics import body_topic, sensor_topics
from pose_io.typestore import make_typestore

TYPES = make_typestore().types
MS = 1_000_000


def header(stamp_ns, frame="map"):
    seconds, nanoseconds = divmod(stamp_ns, 10**9)
    stamp = TYPES["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanoseconds)
    return TYPES["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def skeleton(stamp_ns, x=0.0, person="1", names=JOINTS, state=2):
    point = TYPES["geometry_msgs/msg/Point"]
    return TYPES["pose_msgs/msg/Skeleton"](
        header=header(stamp_ns),
        id=person,
        name=list(names),
        position=[point(x=x, y=float(index), z=2.0) for index in range(len(names))],
        tracking_state=np.full(len(names), state, np.uint8),
    )


def seen(stamp_ns, *persons):
    return TYPES["pose_msgs/msg/SkeletonArray"](header=header(stamp_ns), skeletons=list(persons))


def imu(stamp_ns, variance=0.04):
    quaternion = TYPES["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.6, w=0.8)
    vector = TYPES["geometry_msgs/msg/Vector3"](x=1.0, y=2.0, z=3.0)
    covariance = np.diag([variance] * 3).ravel()
    return TYPES["sensor_msgs/msg/Imu"](
        header=header(stamp_ns),
        orientation=quaternion,
        orientation_covariance=covariance,
        angular_velocity=vector,
        angular_velocity_covariance=covariance,
        linear_acceleration=vector,
        linear_acceleration_covariance=covariance,
    )


def transform(parent, child, rotation, translation):
    x, y, z, w = (float(value) for value in rotation.as_quat())
    return TYPES["geometry_msgs/msg/TransformStamped"](
        header=header(0, parent),
        child_frame_id=child,
        transform=TYPES["geometry_msgs/msg/Transform"](
            translation=TYPES["geometry_msgs/msg/Vector3"](*map(float, translation)),
            rotation=TYPES["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w),
        ),
    )


def tf(*transforms):
    return TYPES["tf2_msgs/msg/TFMessage"](transforms=list(transforms))


@pytest.fixture
def make_bag(tmp_path):
    opened = []

    def make(*entries):
        path = tmp_path / f"bag{len(opened)}"
        with BagWriter(path) as bag:
            for topic, message, stamp_ns in entries:
                bag.write(topic, message, stamp_ns)
        opened.append(open_bag(path))
        return opened[-1]

    yield make
    for bag in opened:
        bag.close()


def test_samples_come_in_the_order_of_recording_whatever_their_stamps(make_bag):
    bag = make_bag(
        ("/kinect_left/skeletons", seen(40 * MS, skeleton(40 * MS)), 50 * MS),
        ("/imu_torso/data", imu(30 * MS), 60 * MS),
        ("/kinect_right/skeletons", seen(20 * MS, skeleton(20 * MS)), 70 * MS),
    )
    order = [
        sample.sensor if isinstance(sample, SkeletonSample) else sample.segments[sample.imu[0]]
        for sample in BagSamples(bag)
    ]
    assert order == ["left", "torso", "right"]


def test_a_skeleton_becomes_positions_in_the_order_of_the_joint_table(make_bag):
    message = skeleton(5 * MS, names=("right_foot", "tail", "head"), state=1)
    bag = make_bag(("/lab/kinect_left/skeletons", seen(5 * MS, message), 6 * MS))
    (sample,) = BagSamples(bag)
    assert (sample.stamp_ns, sample.sensor, sample.person) == (5 * MS, "left", "1")
    assert sample.positions[JOINT_INDEX["right_foot"], 1] == 0.0
    assert sample.positions[JOINT_INDEX["head"], 1] == 2.0
    assert sample.tracking_state[JOINT_INDEX["head"]] == 1
    assert np.isnan(sample.positions[JOINT_INDEX["neck"]]).all()
    assert sample.tracking_state[JOINT_INDEX["neck"]] == 0


def test_a_joint_that_is_not_tracked_has_no_position(make_bag):
    message = skeleton(0)
    message.tracking_state[JOINT_INDEX["neck"]] = 0
    bag = make_bag(("/kinect_left/skeletons", seen(0, message), 1))
    (sample,) = BagSamples(bag)
    is_known = np.isfinite(sample.positions).all(axis=1)
    assert np.flatnonzero(~is_known).tolist() == [JOINT_INDEX["neck"]]


def test_a_skeleton_without_tracked_joints_is_no_person(make_bag):
    bag = make_bag(("/kinect_left/skeletons", seen(0, skeleton(0, state=0)), 1))
    assert list(BagSamples(bag)) == []


def test_an_imu_keeps_its_orientation_and_its_uncertainty(make_bag):
    bag = make_bag(
        ("/kinect_left/skeletons", seen(0, skeleton(0)), 0),
        ("/imu_left_thigh/data", imu(7 * MS), 8 * MS),
        ("/imu_left_thigh/data_raw", imu(7 * MS), 8 * MS),
    )
    (block,) = (s for s in BagSamples(bag) if isinstance(s, ImuBlock))
    assert block.segments == ("left_thigh",)
    assert block.stamps_ns == [7 * MS]
    assert block.orientation[0] == pytest.approx([0.0, 0.0, 0.6, 0.8])
    assert block.orientation_stddev[0] == pytest.approx([0.2, 0.2, 0.2])
    assert block.angular_velocity[0] == pytest.approx([1.0, 2.0, 3.0])


def test_what_imus_sent_between_two_frames_comes_as_one_block(make_bag):
    entries = [("/kinect_left/skeletons", seen(k * MS, skeleton(k * MS)), k * MS) for k in (0, 30)]
    times = [*range(1, 60, 10)]
    entries += [("/imu_torso/data", imu(k * MS), k * MS) for k in times]
    entries += [("/imu_left_shank/data", imu(k * MS), k * MS + 1) for k in times]
    samples = list(BagSamples(make_bag(*sorted(entries, key=lambda entry: entry[2]))))
    assert [type(each) for each in samples] == [SkeletonSample, ImuBlock] * 2
    names = [block.segments[i] for block in samples[1::2] for i in block.imu]
    assert names == ["torso", "left_shank"] * len(times)
    stamps = [stamp for block in samples[1::2] for stamp in block.stamps_ns]
    assert stamps == [k * MS for k in times for _ in range(2)]


def test_an_imu_without_orientation_is_counted_and_left_out(make_bag):
    bag = make_bag(
        ("/kinect_left/skeletons", seen(0, skeleton(0)), 0),
        ("/imu_torso/data", imu(7 * MS, variance=-1.0), 8 * MS),
    )
    samples = BagSamples(bag)
    assert [type(sample) for sample in samples] == [SkeletonSample]
    assert any(line.startswith("IMUs: 1 samples left out") for line in samples.left_out)


def test_imu_samples_without_orientation_are_named_by_topic_with_a_remedy(make_bag):
    bag = make_bag(
        ("/kinect_left/skeletons", seen(0, skeleton(0)), 0),
        ("/imu_head/data", imu(7 * MS), 8 * MS),
        ("/imu_torso/data", imu(7 * MS, variance=-1.0), 8 * MS),
        ("/imu_torso/data", imu(9 * MS, variance=-1.0), 9 * MS),
    )
    frames = BagFrames(bag)
    assert sum(len(each) for each in frames if isinstance(each, ImuBlock)) == 1
    (line,) = (each for each in frames.left_out if each.startswith("IMUs"))
    assert line.startswith("IMUs: 2 samples left out, without an orientation")
    assert "/imu_torso/data: publish" in line
    assert "head" not in line


def test_imu_topics_whose_names_tell_no_segment_are_named_with_the_expected_form(make_bag):
    bag = make_bag(
        ("/kinect_left/skeletons", seen(0, skeleton(0)), 0),
        ("/kinect_left/imu", imu(7 * MS), 8 * MS),  # of the camera
        ("/xsens/pelvis/imu", imu(7 * MS), 8 * MS),
    )
    (line,) = BagFrames(bag).left_out
    assert line.startswith("IMUs: topics not used: /xsens/pelvis/imu: record them as imu_<segment>")
    assert not BagFrames(bag, imus=False).left_out


def test_a_malformed_skeleton_is_left_out_and_said(make_bag):
    broken = skeleton(0)
    broken.tracking_state = broken.tracking_state[:3]
    bag = make_bag(
        ("/kinect_left/skeletons", seen(0, broken), 0),
        ("/kinect_left/skeletons", seen(MS, skeleton(MS)), MS),
    )
    samples = BagSamples(bag)
    assert [sample.stamp_ns for sample in samples] == [MS]
    said = "/kinect_left/skeletons: 1 malformed frames left out, the first: "
    assert any(line.startswith(said) for line in samples.left_out)


def test_misspelled_joints_are_reported_wherever_they_were_recorded(make_bag):
    names = ["left_kne" if name == "left_knee" else name for name in JOINTS]
    one_s = 10**9
    late = [seen(i * one_s, skeleton(i * one_s)) for i in range(1, 200)]
    every = [seen(0, skeleton(0, names=names)), *late]
    for one in every:
        one.header.frame_id = ""
    frames = BagFrames(
        make_bag(*[("/kinect_left/skeletons", one, i * one_s) for i, one in enumerate(every)])
    )
    list(frames)
    assert "lacks left_knee: see their names (messages: 1)" in "\n".join(frames.left_out)


def test_a_bag_without_skeletons_is_refused_with_its_topics(make_bag):
    bag = make_bag(("/imu_torso/data", imu(0), 0))
    with pytest.raises(InputError, match=r"holds no skeletons.*found /imu_torso/data"):
        BagSamples(bag)


def test_two_topics_for_one_sensor_are_refused(make_bag):
    bag = make_bag(
        ("/a/kinect_left/skeletons", seen(0, skeleton(0)), 0),
        ("/b/kinect_left/skeletons", seen(0, skeleton(0)), 0),
    )
    with pytest.raises(InputError, match="'left' twice"):
        sensor_topics(bag)


def test_progress_ends_at_one(make_bag):
    bag = make_bag(("/kinect_left/skeletons", seen(0, skeleton(0)), 0))
    shares = []
    list(BagSamples(bag, progress=shares.append))
    assert shares[-1] == 1.0
    assert shares == sorted(shares)


def test_a_named_person_is_followed_in_every_sensor(make_bag):
    two = seen(0, skeleton(0, x=1.0, person="a"), skeleton(0, x=2.0, person="b"))
    bag = make_bag(("/kinect_left/skeletons", two, 0), ("/kinect_right/skeletons", two, 1))
    series = read_sensor_series(bag, person="b")
    assert {name: each.positions[0, 0, 0] for name, each in series.items()} == {
        "left": 2.0,
        "right": 2.0,
    }


def test_extrinsics_are_found_along_a_chain_of_frames(make_bag):
    quarter = Rotation.from_rotvec([0.0, 0.0, np.pi / 2])
    bag = make_bag(
        (
            "/tf_static",
            tf(
                transform(
                    "kinect_left_optical_frame",
                    "kinect_right_optical_frame",
                    Rotation.identity(),
                    (1.0, 0.0, 0.0),
                ),
                transform("map", "kinect_left_optical_frame", quarter, (0.0, 0.0, 2.0)),
                transform("elsewhere", "kinect_lost_optical_frame", quarter, (0.0, 0.0, 0.0)),
                transform("map", "table", quarter, (0.0, 0.0, 0.0)),
            ),
            0,
        )
    )
    extrinsics = read_extrinsics(bag)
    assert list(extrinsics) == ["left", "right"]
    np.testing.assert_allclose(extrinsics["left"][:3, 3], [0.0, 0.0, 2.0])
    # One metre along the left sensor's x, which is the map's y.
    np.testing.assert_allclose(extrinsics["right"][:3, 3], [0.0, 1.0, 2.0], atol=1e-12)


def test_a_loop_of_frames_leads_nowhere(make_bag):
    one, two = "kinect_left_optical_frame", "kinect_right_optical_frame"
    loop = tf(
        transform(one, two, Rotation.identity(), (0, 0, 0)),
        transform(two, one, Rotation.identity(), (0, 0, 0)),
    )
    assert read_extrinsics(make_bag(("/tf_static", loop, 0))) == {}


def test_no_static_transforms_give_no_extrinsics(make_bag):
    assert read_extrinsics(make_bag(("/imu_torso/data", imu(0), 0))) == {}


def test_extrinsics_of_a_graph_in_a_namespace_are_found_but_not_the_truth(make_bag):
    left = transform("map", "kinect_left_optical_frame", Rotation.identity(), (0.0, 0.0, 2.0))
    bag = make_bag(("/operator_1/tf_static", tf(left), 0), ("/truth/tf_static", tf(left), 0))
    assert list(read_extrinsics(bag)) == ["left"]
    assert read_extrinsics(make_bag(("/truth/tf_static", tf(left), 0))) == {}


def test_a_body_of_a_graph_in_a_namespace_is_found(make_bag):
    topic = "/operator_1/humans/bodies/subject/skeleton"
    bag = make_bag((topic, skeleton(0, x=1.0), 0))
    assert body_topic(bag, "skeleton") == body_topic(bag, "skeleton", "subject") == topic
    assert body_topic(bag, "skeleton", "somebody") is None
    assert read_body_series(bag).positions[0, 0, 0] == 1.0


def test_a_body_in_two_namespaces_is_refused(make_bag):
    bag = make_bag(
        ("/a/humans/bodies/subject/skeleton", skeleton(0), 0),
        ("/b/humans/bodies/subject/skeleton", skeleton(0), 0),
    )
    with pytest.raises(InputError, match=r"'subject' twice, as /a/.* and /b/"):
        body_topic(bag, "skeleton")


def test_the_subject_is_not_one_of_the_other_people(make_bag):
    names = ("person_2", "walker")
    bag = make_bag(*((f"/humans/bodies/{name}/skeleton", skeleton(0), 0) for name in names))
    assert body_topic(bag, "skeleton") == "/humans/bodies/walker/skeleton"


def test_the_truth_of_a_simulation_is_found_in_its_namespace_alone(make_bag):
    bag = make_bag(
        ("/humans/bodies/subject/skeleton", skeleton(0, x=1.0), 0),
        ("/truth/humans/bodies/subject/skeleton", skeleton(0, x=2.0), 0),
    )
    assert body_topic(bag, "skeleton") == "/humans/bodies/subject/skeleton"
    assert read_body_series(bag).positions[0, 0, 0] == 1.0
    assert read_body_series(bag, namespace="/truth").positions[0, 0, 0] == 2.0


def test_a_missing_body_is_named(make_bag):
    bag = make_bag(("/imu_torso/data", imu(0), 0))
    with pytest.raises(InputError, match=r"holds no /humans/bodies/<id>/skeleton"):
        read_body_series(bag)


def test_estimates_are_read_as_columns(make_bag):
    def estimate(stamp_ns, latency):
        return TYPES["pose_msgs/msg/PoseEstimate"](
            header=header(stamp_ns),
            id="subject",
            name=["pelvis_x", "left_knee_flexion"],
            position=np.array([1.0, 0.5]),
            velocity=np.zeros(2),
            position_stddev=np.array([0.01, 0.02]),
            weight_kinect=np.array([1.0, 0.8]),
            weight_imu=np.array([0.0, 0.2]),
            state=np.array([1, 3], np.uint8),
            latency=latency,
        )

    topic = "/humans/bodies/subject/estimate"
    estimates = read_estimates(
        make_bag((topic, estimate(0, 0.010), 0), (topic, estimate(MS, 0.012), 1))
    )
    assert estimates.names == ("pelvis_x", "left_knee_flexion")
    assert estimates.weight_imu[:, 1] == pytest.approx([0.2, 0.2])
    assert estimates.latency_s == pytest.approx([0.010, 0.012])


def test_a_bag_without_estimates_gives_none(make_bag):
    assert len(read_estimates(make_bag(("/imu_torso/data", imu(0), 0))).stamps_ns) == 0


def test_stamps_are_corrected_from_where_a_clock_is_set(make_bag):
    entries = []
    for k in range(60):
        recorded_ns = 10**9 + k * 33 * MS
        stamp_ns = recorded_ns - 20 * MS + (2000 * MS if k >= 30 else 0)
        entries.append(("/kinect_left/skeletons", seen(stamp_ns, skeleton(stamp_ns)), recorded_ns))
        entries.append(("/imu_torso/data", imu(recorded_ns - 5 * MS), recorded_ns))
    frames = BagFrames(make_bag(*entries))
    read = list(frames)

    stamps_ns = [each[0].stamp_ns for each in read if not isinstance(each, ImuBlock)]
    assert stamps_ns == [10**9 + k * 33 * MS - 20 * MS for k in range(60)]
    imus_ns = [ns for each in read if isinstance(each, ImuBlock) for ns in each.stamps_ns]
    assert imus_ns == [10**9 + k * 33 * MS - 5 * MS for k in range(60)]
    line = frames.left_out[-1]
    assert line.startswith("left: clock set by +2.00 s at 1.0 s of the recording")
