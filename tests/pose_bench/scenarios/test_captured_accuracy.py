"""Bounds of the accuracy on captured motion with simulated sensors, and on a real recording."""

from dataclasses import replace

import numpy as np
import pytest

from pose_bench.captured import METHODS, run_session, true_extrinsics, truth_of
from pose_bench.captured_suite import captured_specs
from pose_bench.kinectmultitrack import compare_views
from pose_core.api import ImuSample, Pipeline, PipelineParameters
from pose_evaluation.offline import run_pipeline
from pose_io.recordings.formats import read_recording
from pose_sim.captured.clips import bundled_clips, mid_hip
from pose_sim.captured.session import SENSORS, make_captured_session

CHOSEN = ("joint_kf", "default", "default+imus")
METHODS_TRIED = [method for method in METHODS if method.name in CHOSEN]
DURATION_S = 25.0
S = 10**9  # [ns]
WITHIN = 0.05  # [-] of the recorded figures: a gain is recorded too
CALM, SPINNING, LATE = "calm", "spinning", "late"
RECORDED_DEG = {
    CALM: (4.67, 3.16),
    SPINNING: (5.60, 3.12),
    LATE: (4.57, 2.65),
}  # without, with IMUs
REAL_DEG = 10.01  # [deg] and
REAL_CM = 5.27  # [cm] from what the other camera saw


@pytest.fixture(scope="module", params=[CALM, SPINNING, LATE])
def scores(request):
    is_late = request.param == LATE
    spec = captured_specs(None, held_out=True, seed=12 if is_late else 11)[0]
    delays_s = (0.08, 0.03) if is_late else None
    spins = request.param == SPINNING
    spec = replace(spec, spins=spins, duration_s=DURATION_S, delays_s=delays_s)
    return request.param, {each.method: each for each in run_session(spec, METHODS_TRIED)}


def test_the_default_estimator_is_as_accurate_as_it_was(scores):
    session, by_method = scores
    assert by_method["default"].rmse_deg == pytest.approx(RECORDED_DEG[session][0], rel=WITHIN)
    assert by_method["default"].rmse_ratio < 0.5


def test_imus_make_it_better_and_it_is_as_accurate_with_them_as_it_was(scores):
    session, by_method = scores
    assert by_method["default+imus"].rmse_deg == pytest.approx(RECORDED_DEG[session][1], rel=WITHIN)
    assert by_method["default+imus"].mpjpe_mm < by_method["default"].mpjpe_mm


def test_without_cameras_imus_on_both_legs_carry_the_root_along():
    clips = {clip.stem: clip for clip in bundled_clips()}
    spec = replace(
        captured_specs(None, held_out=True, seed=11)[0],
        clips=(clips["jumping_2"], clips["walking_20"]),
        spins=False,
        duration_s=25.0,
        delays_s=None,
    )
    session = make_captured_session(spec)
    truth = truth_of(session)
    end_ns = int(truth.stamps_ns[-1]) - S // 4
    begin_ns = end_ns - 4 * S
    samples = [
        each
        for each in session.samples(imus=True)
        if isinstance(each, ImuSample) or each.stamp_ns < begin_ns
    ]
    pipeline = Pipeline(PipelineParameters(sensors=SENSORS), true_extrinsics(session))
    run = run_pipeline(pipeline, samples)
    instants_ns = np.array([begin_ns, end_ns])
    moved, followed = (
        np.diff(mid_hip(series.at(instants_ns))[:, :2], axis=0)[0] for series in (truth, run.series)
    )
    assert np.linalg.norm(moved) > 2.0
    assert np.linalg.norm(followed - moved) < 0.2 * np.linalg.norm(moved)


@pytest.mark.data
def test_one_real_camera_agrees_with_the_other_as_well_as_it_did(shared_data):
    name = "Study_5_Kinect_1_Time_1_55_35_PM.csv.gz"
    recording = read_recording(shared_data / "kinectmultitrack" / name, "kinectmultitrack")
    (fused,) = (each for each in compare_views(recording, 0, ["default"]) if each.method != "raw")
    assert fused.angle_deg == pytest.approx(REAL_DEG, rel=WITHIN)
    assert fused.distance_cm == pytest.approx(REAL_CM, rel=WITHIN)
