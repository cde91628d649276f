import re
from dataclasses import replace

import numpy as np
import pytest
from exported_motion import write_motion_bag
from moving_body import motion
from session_bag import MAKE, write_session

from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_core.api import load_body_model
from pose_core.arrays import rows_of
from pose_core.errors import InputError
from pose_core.estimators import ESTIMATORS
from pose_core.joints import JOINT_INDEX
from pose_core.session.extrinsics import extrinsics_from_map
from pose_core.streams.samples import SkeletonSample
from pose_evaluation.offline import ALIASES, IMU_ENDING, known_setups
from pose_evaluation.tables import view_tables
from pose_io.bag_writer import BagWriter
from pose_io.bags import open_bag
from pose_io.references.reference import reference_of_skeleton
from pose_view.report.analysis import analyse
from pose_view.report.figures.canvas import thinned
from pose_view.report.figures.courses import (
    attitude_figures,
    attitude_sources,
    joint_figures,
    occlusions,
)
from pose_view.report.page.page import RAW, facts, notes, render_page, verdict
from pose_view.report.report_data import Wanted, preferred, read_report_data


def seen_by(sensor, **kind):
    series = motion(rate=30.0, duration_s=6.0, **kind)
    for stamp_ns, positions in zip(series.stamps_ns, series.positions, strict=True):
        yield SkeletonSample(
            stamp_ns=int(stamp_ns),
            sensor=sensor,
            person="1",
            positions=positions + [0.0, 0.0, 2.0],
            tracking_state=np.full(15, 2, np.uint8),
        )


def read(path, *methods, extrinsics=None, **wanted):
    def placed(_, sensors):
        if extrinsics is not None:
            raise extrinsics
        return extrinsics_from_map(dict.fromkeys(sensors, np.eye(4)))

    with open_bag(path) as bag:
        asked = Wanted(name="walk", methods=methods, **wanted)
        return read_report_data(bag, asked, placed, lambda share: None)


@pytest.fixture
def two(tmp_path):
    samples = [*seen_by("left"), *seen_by("right", begin_s=0.01)]
    return write_session(tmp_path / "two", samples, text="a real person")


@pytest.fixture
def one(tmp_path):
    return write_session(tmp_path / "one", seen_by("left"), text="")


def test_methods_stand_in_the_order_of_the_papers(two):
    found = list(read(two, "left", "right", "mean", "joint_kf").methods)
    assert found == ["left", "right", "mean", "joint_kf"]


def test_one_sensor_has_a_report_too(one):
    recording = read(one, "left", "joint_kf")
    assert list(recording.methods) == ["left", "joint_kf"]
    analysis = analyse(recording, None)
    assert view_tables(analysis.views) == []
    assert set(analysis.stability) == {"left", "joint_kf"}


def test_a_bag_without_a_camera_is_refused_with_what_it_holds(tmp_path):
    path = tmp_path / "fused"
    with BagWriter(path) as bag:
        bag.write("/tf_static", MAKE.sensor_transforms({"left": np.eye(4)}, 0), 1)
    with pytest.raises(InputError, match=r"holds no skeletons: expected topics kinect_<name>"):
        read(path)


def test_a_bag_of_fused_bodies_alone_has_a_report(tmp_path):
    write_motion_bag(tmp_path / "fused", load_body_model("default"))
    recording = read(tmp_path / "fused")
    assert list(recording.methods) == [recording.focus] == ["fused"]
    assert not any("places are unknown" in note for note in recording.notes)
    _, near, to_do = verdict(analyse(recording, None))
    assert near == f"The recording holds no {RAW}: there are no views to compare."
    assert to_do == f"To compare the views, record or keep the {RAW} beside the fused pose."


def test_the_report_says_when_no_camera_saw_the_person(two):
    recording = read(two, "joint_kf")
    estimates = recording.estimates["joint_kf"]
    assert not any("no camera" in note for note in notes(analyse(recording, None)))
    source = np.array(estimates.source)
    source[len(source) // 3 :] = 0
    gone = replace(recording, estimates={"joint_kf": replace(estimates, source=source)})
    lines = [note for note in notes(analyse(gone, None)) if "no camera" in note]
    assert len(lines) == 1
    assert lines[0].endswith("poses by prediction.")


def test_where_the_sensors_stand_may_be_unknown(two):
    recording = read(two, extrinsics=CalibrationError("too little motion"))
    assert list(recording.methods) == ["left", "right"]
    assert any("too little motion" in note for note in notes(analyse(recording, None)))


def test_a_recording_of_a_person_is_not_called_synthetic(two):
    recording = read(two, "left")
    analysis = analyse(recording, None)
    assert not analysis.is_synthetic
    assert dict(facts(analysis))["its source says"] == "a real person"


def test_a_sources_comment_cannot_break_the_page(tmp_path):
    path = write_session(tmp_path / "bag", seen_by("left"), text="</dd><script>alert(1)</script>")
    page = render_page(analyse(read(path, "left"), None), "left_hand")
    assert "<script" not in page
    assert "Path of the left hand" in page
    assert "Simulated sensors" not in page


def test_the_same_recording_gives_the_same_drawings(two):
    analysis = analyse(read(two, "left", "mean"), None)
    assert joint_figures(analysis, "left_hand") == joint_figures(analysis, "left_hand")


def test_single_figures_show_the_requested_method(two):
    assert read(two, "left", "mean").focus == "mean"
    assert read(two, "left", "mean", focus="left").focus == "left"


def late_start(recording, name, begin_s):
    """The same recording, in which a method began late."""
    series = recording.methods[name]
    late = series.between(int(begin_s * 1e9), int(series.stamps_ns[-1]))
    return replace(recording, methods={**recording.methods, name: late})


def on_own_clock():
    return reference_of_skeleton("trial.c3d", motion(duration_s=6.0).shifted(1000.0))


def test_a_method_that_began_late_is_left_out_of_the_comparison_and_named(two):
    recording = late_start(read(two, "left", "mean"), "mean", 4.5)
    analysis = analyse(recording, on_own_clock())
    assert [method.name for method in analysis.compared.evaluation.methods] == ["left"]
    assert analysis.compared.aligned_with == "left"
    assert any(note.startswith("mean: too little in common") for note in notes(analysis))
    said = "mean is not compared with the reference, with which it has only 1.5 s in common"
    assert verdict(analysis)[0].startswith(said)


@pytest.mark.parametrize(("begin_s", "said"), [(1e9, None), (1.7e9, "2023-11-14 22:13:20 UTC")])
def test_stamps_that_are_no_dates_have_none(two, begin_s, said):
    analysis = analyse(replace(read(two, "left"), begin_ns=round(begin_s * 1e9)), None)
    assert dict(facts(analysis)).get("begins") == said


def test_the_shift_of_the_reference_is_stated(two):
    analysis = analyse(read(two, "left", "mean"), on_own_clock())
    said = dict(facts(analysis))["aligned in time"]
    found = re.match(r"its first frame was put ([+−0-9.]+) s after the recording's, by ", said)
    assert float(found[1].replace("−", "-")) == pytest.approx(0.0, abs=0.005)
    assert "relative to mean" in said


def test_a_stretch_can_be_reported_alone(two):
    recording = read(two, "left", "joint_kf", from_s=3.0, until_s=5.0)
    assert recording.duration_s == pytest.approx(2.0, abs=0.05)
    stamps_ns = recording.estimates["joint_kf"].stamps_ns
    assert 3.0e9 <= stamps_ns[0] < stamps_ns[-1] <= 5.0e9
    assert "from 3.0 to 5.0 s of a longer recording" in recording.notes[0]


def test_an_empty_stretch_is_refused(two):
    with pytest.raises(InputError, match="no person is seen from 60 to inf s"):
        read(two, "left", from_s=60.0)


def test_pitch_and_yaw_are_shown_by_kinect_by_imus_and_fused(two):
    recording = read(two, "left", "mean")
    as_if = dict.fromkeys(("imu", "default+imus"), recording.methods["mean"])
    analysis = analyse(replace(recording, methods={**recording.methods, **as_if}), None)
    roles = {"Kinect": "left", "IMUs": "imu", "fused": "default+imus"}
    assert attitude_sources(analysis) == roles
    drawing = attitude_figures(analysis).pictures[0].svg
    assert all(f'class="method-role-{role.lower()}"' in drawing for role in roles)


def test_occlusions_are_when_a_limbs_ends_are_not_tracked_or_no_frame_comes():
    series = motion(rate=30.0, duration_s=6.0)
    times_s = (series.stamps_ns - series.stamps_ns[0]) * 1e-9
    series.tracking_state[(times_s > 2.0) & (times_s < 3.0), JOINT_INDEX["left_knee"]] = 1
    silent = rows_of(series, (times_s < 4.0) | (times_s > 4.5))

    def found(limb):
        return np.ravel(occlusions(silent, limb, int(series.stamps_ns[0]), 6.0))

    assert found("left_shank") == pytest.approx([2.0, 1.0, 4.0, 0.5], abs=0.08)
    assert found("right_shank") == pytest.approx([4.0, 0.5], abs=0.08)


def test_all_methods_are_without_second_names(one):
    methods = read(one, "all").methods
    assert {"joint_kf", "li2020", "default"} <= set(methods)
    assert not set(ALIASES) & set(methods)
    of_class = {estimator: name for name, estimator in reversed(ESTIMATORS.items())}
    assert set(ALIASES) == set(ESTIMATORS) - set(of_class.values())


def test_long_lines_keep_their_peaks_and_their_gaps():
    times = np.arange(60_000) / 30.0
    values = np.sin(times)
    values[12_345], values[30_000:30_040] = 9.0, np.nan
    at, kept = thinned(times, values)
    assert len(at) < 2000
    assert np.nanmax(kept) == 9.0
    assert np.isnan(kept).any()
    assert (np.diff(at) > 0.0).all()


def test_an_unknown_method_is_refused_with_those_that_there_are(two):
    with pytest.raises(
        InputError, match="no method magic here: expected some of left, right, mean"
    ):
        read(two, "left", "magic")


@pytest.mark.parametrize(
    ("names", "best"),
    [
        (["left", "mean", "li2020", "fused"], "fused"),
        (["left", "li2020", "default", "default+imus"], "default+imus"),
        (["left", "right"], "left"),
    ],
)
def test_the_method_to_show_is_the_best_there_is(names, best):
    assert preferred(names) == best


def test_imus_are_used_only_where_there_are_any():
    without = [setup.name for setup in known_setups(has_imus=False)]
    assert not any(name.endswith(IMU_ENDING) or name == "imu" for name in without)
    with_imus = known_setups(has_imus=True)
    assert any(setup.name.endswith(IMU_ENDING) and setup.use_imus for setup in with_imus)
    assert [setup.name for setup in with_imus if not setup.use_imus] == without


def test_every_estimator_that_filters_is_run():
    names = {setup.estimator for setup in known_setups(has_imus=True)}
    assert {"joint_kf", "dof_kf", "li2020"} <= names
    assert not names & {"left", "right", "mean"}
