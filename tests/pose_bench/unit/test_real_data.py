import csv
import io
from contextlib import nullcontext

import numpy as np
import pytest
from rich.console import Console
from rich.progress import Progress

from pose_bench import kinectmultitrack, pool, uiprmd
from pose_bench.one_camera import RAW
from pose_bench.pool import run_all
from pose_bench.sessions import SessionSpec, bench_session
from pose_bench.tools import bench
from pose_bench.tools.accuracy import rows_csv
from pose_core.errors import InputError
from pose_core.streams.angle_series import AngleSeries, angle_series
from pose_io.recordings.recording import make_recording, make_stream


@pytest.fixture(scope="module")
def squats():
    spec = SessionSpec(choreography="squats", level="typical", seed=6, duration_s=20.0)
    return bench_session(spec, imus=False)


def two_cameras(squats, right_late_ns=0):
    """A recording as KinectMultiTrack's, of the virtual Kinects."""
    streams = []
    for sensor in ("left", "right"):
        samples = [s for s in squats.skeletons if s.sensor == sensor]
        late_ns = right_late_ns if sensor == "right" else 0
        streams.append(
            make_stream(
                sensor,
                host_time_ns=[s.stamp_ns + late_ns for s in samples],
                sensor_time_ns=None,
                person=["0"] * len(samples),
                positions=np.array([s.positions for s in samples]),
                tracking_state=np.array([s.tracking_state for s in samples]),
            )
        )
    return make_recording("Study_1_Kinect_1.csv", "kinectmultitrack", streams)


def test_an_estimator_that_returns_its_input_has_the_error_of_the_raw_view(squats):
    raw, mean = kinectmultitrack.compare_views(two_cameras(squats), 0, ["mean"])

    assert (raw.method, mean.method) == (RAW, "mean")
    assert raw.layout == "45°"
    assert 1.0 < raw.distance_cm < 8.0
    assert mean.distance_cm == pytest.approx(raw.distance_cm, rel=1e-3)
    assert mean.angle_deg == pytest.approx(raw.angle_deg, rel=1e-3)


def test_two_cameras_whose_clocks_differ_are_compared_at_the_same_instants(squats):
    on_time, _ = kinectmultitrack.compare_views(two_cameras(squats), 1, ["mean"])
    late, _ = kinectmultitrack.compare_views(two_cameras(squats, 150_000_000), 1, ["mean"])

    assert late.distance_cm == pytest.approx(on_time.distance_cm, rel=0.03)


def test_lag_counts_against_an_estimate(squats, monkeypatch):
    honest = kinectmultitrack.run_one_camera

    def late(estimator, samples):
        run = honest(estimator, samples)
        return type(run)(**{**vars(run), "series": run.series.shifted(0.3)})

    monkeypatch.setattr(kinectmultitrack, "run_one_camera", late)
    raw, mean = kinectmultitrack.compare_views(two_cameras(squats), 0, ["mean"])

    assert mean.distance_cm > 1.1 * raw.distance_cm
    assert mean.angle_deg > 1.1 * raw.angle_deg


def test_agreement_with_a_vicon_is_about_the_mean_error_after_the_best_time_shift(squats):
    truth = squats.evaluated_truth
    angles = dict(angle_series(truth).angles)
    angles["left_knee_flexion"] = angles["left_knee_flexion"] + np.radians(20.0)
    vicon = AngleSeries(stamps_ns=truth.stamps_ns, angles=angles)

    found = uiprmd.agreement(truth.shifted(0.11), vicon, ["left_knee_flexion", "right_hip_flexion"])

    for score in found.values():
        assert score.sd_deg == pytest.approx(0.0, abs=0.1)
        assert score.r > 0.999


def test_an_arm_overhead_whose_flexion_wraps_has_no_effect(squats):
    stamps_ns = squats.evaluated_truth.stamps_ns
    flexion = np.pi + 0.3 * np.sin(4.0 * np.arange(len(stamps_ns)) / 100.0)

    score = uiprmd._score(flexion - 2.0 * np.pi * (flexion > np.pi) + 0.1, flexion)

    assert score.sd_deg == pytest.approx(0.0, abs=1e-6)


def test_rows_of_real_people_are_marked(squats):
    views = kinectmultitrack.compare_views(two_cameras(squats), 0, ["mean"])

    rows = list(csv.DictReader(io.StringIO(rows_csv(views))))

    assert [row["subject_kind"] for row in rows] == ["real", "real"]
    assert float(rows[0]["distance_cm"]) == pytest.approx(views[0].distance_cm, rel=1e-4)


def test_the_tool_writes_the_table_and_the_csv(squats, tmp_path, monkeypatch, capsys):
    recording = two_cameras(squats)
    monkeypatch.setattr(kinectmultitrack, "single_person_recordings", lambda _: [recording])
    arguments = ["accuracy", "--kinectmultitrack", "there", "--methods", "joint_kf", "--jobs", "1"]

    status = bench.run([*arguments, "-o", str(tmp_path / "out")])

    assert status == 0
    names = {"accuracy.md", "accuracy_kinectmultitrack.csv"}
    assert {path.name for path in (tmp_path / "out").iterdir()} == names
    assert "joint_kf [cm]" in (tmp_path / "out" / "accuracy.md").read_text()
    assert "KinectMultiTrack" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "no recordings: expected --uiprmd DIR, --kinectmultitrack DIR or both"),
        (["--jobs", "0", "--uiprmd", "/nonexistent"], "jobs = 0: expected 1 or more"),
        (["--uiprmd", "/nonexistent"], "found no repetition of UI-PRMD"),
        (["--kinectmultitrack", "/nonexistent"], "found no KinectMultiTrack"),
    ],
)
def test_bad_arguments_end_in_one_line(arguments, message):
    with pytest.raises(InputError, match=message) as error:
        bench.run(["accuracy", *arguments])
    assert "\n" not in str(error.value)


def test_results_keep_the_order_of_the_arguments_in_several_processes(monkeypatch):
    with Progress(console=Console(quiet=True)) as bar:
        monkeypatch.setattr(pool, "progress_bar", lambda *_: nullcontext(bar))
        powers = run_all(pow, [(2, n) for n in range(6)], jobs=2, name="powers")

    assert powers == [1, 2, 4, 8, 16, 32]
    assert [(task.completed, task.total) for task in bar.tasks] == [(6, 6)]


@pytest.mark.data
def test_a_real_kinect_follows_a_real_vicon(shared_data):
    used, left_out = uiprmd.read_repetitions(shared_data / "uiprmd")
    squats = [r for r in used if r.movement == "01" and r.subject == "03"]

    found = uiprmd.compare_subject(squats, RAW)

    knees = [each for each in found if "knee" in each.angle]
    assert len(knees) == 4
    assert all(each.sd_deg < 6.0 and each.r > 0.99 for each in knees)
    assert left_out["without_vicon"] == 2


@pytest.mark.data
def test_an_estimate_of_a_real_session_is_cut_into_its_repetitions(shared_data):
    used, _ = uiprmd.read_repetitions(shared_data / "uiprmd")
    own = [r for r in used if r.movement == "01" and r.subject == "03"]

    raw, mean = (uiprmd.compare_subject(own, name) for name in (RAW, "mean"))

    assert raw
    for one, other in zip(raw, mean, strict=True):
        assert (one.repetition, one.angle) == (other.repetition, other.angle)
        assert other.sd_deg == pytest.approx(one.sd_deg, abs=0.3)


@pytest.mark.data
def test_real_recordings_of_one_person_are_distinguished_from_those_of_two(shared_data):
    recordings = kinectmultitrack.single_person_recordings(shared_data / "kinectmultitrack")

    assert len(recordings) == 7
    assert not any("two_persons" in recording.source for recording in recordings)
