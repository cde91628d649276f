import hashlib
import sys

import numpy as np
import pytest
import yaml

from imu_bridge.devices import PortConfig, read_devices
from pose_core.api import load_body_model
from pose_core.errors import InputError, ParameterError, PoseError
from pose_core.joints import JOINTS
from pose_io.bags import open_bag
from pose_io.recordings.formats import plain_csv
from pose_sim import imu_file
from pose_sim.session import make_session, read_overrides, settings_of
from pose_sim.session_folder import write_session
from pose_sim.tools import generate
from pose_sim.virtual_imu import NODES

START_NS = 1_700_000_000_000_000_000


@pytest.fixture(scope="module")
def session():
    return make_session("leg_lift_march", 8.0, 7, settings_of())


@pytest.fixture(scope="module")
def folder(session, tmp_path_factory):
    path = tmp_path_factory.mktemp("session") / "s"
    write_session(path, session, START_NS)
    return path


def digests(folder):
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_the_folder_holds_what_the_devices_and_the_evaluation_need(folder):
    assert set(digests(folder)) == {
        "kinects.csv",
        "imu.npz",
        "imu_nodes.yaml",
        "session.yaml",
        "truth/metadata.yaml",
        "truth/truth.mcap",
    }


def test_the_same_seed_gives_the_same_bytes(folder, tmp_path):
    again = make_session("leg_lift_march", 8.0, 7, settings_of())
    write_session(tmp_path / "s", again, START_NS)
    assert digests(tmp_path / "s") == digests(folder)


def test_a_clock_offset_changes_only_the_second_sensors_stamps(session):
    late = make_session(
        "leg_lift_march", 8.0, 7, settings_of("typical", {"kinect": {"clock_offset": 0.08}})
    )
    assert np.array_equal(late.kinects["left"].host_time_ns, session.kinects["left"].host_time_ns)
    right, moved = session.kinects["right"], late.kinects["right"]
    common = np.isin(moved.capture_s, right.capture_s)
    assert np.array_equal(
        moved.host_time_ns[common] - 80_000_000,
        right.host_time_ns[np.isin(right.capture_s, moved.capture_s)],
    )


@pytest.mark.parametrize(("name", "share"), [("easy", 0.5), ("hard", 2.0)])
def test_a_level_of_difficulty_scales_the_joints_errors(name, share):
    typical, other = settings_of("typical").kinect, settings_of(name).kinect
    for error in ("joint_bias", "wander_moving", "hidden_error", "lag", "glitch_rate"):
        assert getattr(other, error) == pytest.approx(share * getattr(typical, error))


def test_another_seed_gives_other_files(folder, tmp_path):
    write_session(tmp_path / "s", make_session("leg_lift_march", 8.0, 8, settings_of()), START_NS)
    other, first = digests(tmp_path / "s"), digests(folder)
    for name in ("kinects.csv", "imu.npz", "session.yaml", "truth/truth.mcap"):
        assert other[name] != first[name], name


def test_kinect_bridge_reads_both_sensors_as_they_were(folder, session):
    recording = plain_csv.read(folder / "kinects.csv")
    assert [stream.name for stream in recording.streams] == ["left", "right"]
    assert recording.time_zero_ns == 0
    for stream in recording.streams:
        frames = session.kinects[stream.name]
        assert np.array_equal(stream.host_time_ns, frames.host_time_ns)
        assert np.array_equal(stream.sensor_time_ns, frames.sensor_time_ns)
        assert np.array_equal(stream.tracking_state, frames.tracking_state)
        assert np.allclose(stream.positions, frames.positions, atol=1e-6, equal_nan=True)


@pytest.mark.parametrize("seed", range(4))
def test_the_facing_sensor_is_the_first_of_the_recording(seed):
    kinects = make_session("bow", 5.0, seed, settings_of()).kinects
    assert kinects["left"].host_time_ns[0] < kinects["right"].host_time_ns[0]


def test_imu_bridge_reads_the_nodes_file(folder):
    nodes = read_devices(folder / "imu_nodes.yaml", PortConfig(name="sink")).nodes
    assert {node.node_id: node.segment for node in nodes} == NODES


def test_the_imu_file_is_read_as_it_was_written(folder, session):
    frames, note = imu_file.read(folder / "imu.npz")
    assert "synthetic" in note
    for name, column in vars(session.imus).items():
        assert np.array_equal(getattr(frames, name), column), name


def test_every_file_is_marked_as_synthetic(folder):
    for name in ("kinects.csv", "imu_nodes.yaml", "session.yaml"):
        assert "synthetic" in (folder / name).read_text().splitlines()[0]
    assert yaml.safe_load((folder / "session.yaml").read_text())["synthetic"] is True
    with open_bag(folder / "truth") as bag:
        (about,) = bag.messages(["/truth/about"])
        assert "synthetic" in bag.deserialize(about).data


def test_the_truth_holds_skeletons_and_joint_states_at_100_hz(folder, session):
    with open_bag(folder / "truth") as bag:
        counts = {name: topic.count for name, topic in bag.topics.items()}
        skeletons = [
            bag.deserialize(m) for m in bag.messages(["/truth/humans/bodies/subject/skeleton"])
        ]
        states = [
            bag.deserialize(m) for m in bag.messages(["/truth/humans/bodies/subject/joint_states"])
        ]
    assert counts["/truth/humans/bodies/subject/skeleton"] == 801
    stamps = [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in skeletons]
    assert stamps[0] == START_NS
    assert set(np.diff(stamps)) == {10_000_000}
    assert tuple(skeletons[0].name) == JOINTS
    assert skeletons[0].header.frame_id == "map"
    at = session.motion.joints_at(np.array([6.0]))[0]
    assert np.allclose([[p.x, p.y, p.z] for p in skeletons[600].position], at, atol=1e-9)
    assert tuple(states[0].name) == load_body_model("default").angle_names
    assert np.allclose(states[100].position, 0.0, atol=1e-6)
    position = np.array([m.position for m in states])
    velocity = np.array([m.velocity for m in states])
    assert np.allclose(np.gradient(position, 0.01, axis=0)[1:-1], velocity[1:-1], atol=0.2)


def test_the_truth_holds_where_the_sensors_stand(folder, session):
    with open_bag(folder / "truth") as bag:
        (message,) = bag.messages(["/truth/tf_static"])
        transforms = bag.deserialize(message).transforms
    assert [t.child_frame_id for t in transforms] == [
        "kinect_left_optical_frame",
        "kinect_right_optical_frame",
    ]
    for transform, pose in zip(transforms, session.sensor_poses.values(), strict=True):
        place = transform.transform.translation
        assert transform.header.frame_id == "map"
        assert np.allclose((place.x, place.y, place.z), pose[:3, 3])


def test_map_has_its_origin_below_the_first_sensor_and_x_along_its_view(session):
    left = session.sensor_poses["left"]
    assert np.allclose(left[:2, 3], 0.0)
    assert left[0, 2] > 0.95  # optical z
    assert abs(left[1, 2]) < 1e-9
    for pose in session.sensor_poses.values():
        assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)


def test_an_existing_folder_is_never_overwritten(session, tmp_path):
    (tmp_path / "s").mkdir()
    with pytest.raises(InputError, match="exists already"):
        write_session(tmp_path / "s", session, 0)
    assert list((tmp_path / "s").iterdir()) == []


def test_a_failure_leaves_nothing_behind(session, tmp_path, monkeypatch):
    def fail(*_):
        raise InputError("the disk is full")

    monkeypatch.setattr("pose_sim.session_folder.write_truth", fail)
    with pytest.raises(InputError, match="disk"):
        write_session(tmp_path / "s", session, 0)
    assert list(tmp_path.iterdir()) == []


def test_a_presets_parameters_can_be_replaced_one_by_one():
    settings = settings_of("hard", {"kinect": {"frame_rate": 15}, "scene": {"aside": 90.0}})
    assert settings.kinect.frame_rate == 15.0
    assert settings.kinect.wander_moving == settings_of("hard").kinect.wander_moving
    assert settings.scene.aside == 90.0


@pytest.mark.parametrize(
    ("preset", "overrides", "error", "message"),
    [
        ("loud", {}, InputError, "unknown noise 'loud'"),
        ("clean", {"camera": {}}, InputError, "unknown section 'camera'"),
        ("clean", {"kinect": 3}, InputError, "section 'kinect'"),
        ("clean", {"kinect": {"frame_rate": -5.0}}, ParameterError, r"frame_rate = -5.0 Hz is out"),
        ("clean", {"imu": {"beta": 1.0}}, ParameterError, "unknown parameter beta"),
        ("typical", {"imu": {"misalignment_max": 1.0}}, InputError, "is above"),
    ],
)
def test_a_wrong_setting_is_refused(preset, overrides, error, message):
    with pytest.raises(error, match=message):
        settings_of(preset, overrides)


@pytest.mark.parametrize("text", ["- 1\n- 2\n", "kinect: [", "just words"])
def test_a_parameter_file_that_is_no_mapping_is_refused(tmp_path, text):
    path = tmp_path / "p.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=str(path)):
        read_overrides(path)


@pytest.mark.parametrize("content", [None, b"", b"not an archive"])
def test_a_missing_or_wrong_imu_file_is_refused(tmp_path, content):
    path = tmp_path / "imu.npz"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=str(path)):
        imu_file.read(path)


def test_generate_makes_a_session_from_its_arguments(tmp_path, monkeypatch, capsys):
    path = tmp_path / "new" / "s"
    words = ["--choreography", "bow", "--duration", "6", "--seed", "3", "--noise", "clean"]
    monkeypatch.setattr(sys, "argv", ["generate", "-o", str(path), *words, "--start-at", "5"])
    generate.run()
    said = yaml.safe_load((path / "session.yaml").read_text())
    assert (said["choreography"], said["seed"], said["noise"]) == ("bow", 3, "clean")
    assert said["start_at"] == 5
    assert "synthetic" in capsys.readouterr().err


def test_generate_refuses_a_negative_seed(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["generate", "-o", str(tmp_path / "s"), "--seed", "-1"])
    with pytest.raises(PoseError, match="seed = -1"):
        generate.run()
