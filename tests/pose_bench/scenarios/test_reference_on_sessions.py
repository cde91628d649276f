"""On whole sessions, each step of the compiled filter equals that of the plain one."""

from collections import Counter
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from equal_states import assert_equal_states

from pose_bench.captured import true_extrinsics
from pose_bench.captured_suite import captured_specs
from pose_bench.reference.default_filter import ReferenceFilter
from pose_calibration.session_calibration import calibrate
from pose_core.api import Pipeline, PipelineParameters, SkeletonSample
from pose_core.estimators import default
from pose_core.filter.error_state_filter import ErrorStateFilter
from pose_evaluation.offline import run_pipeline
from pose_io.samples import read_samples
from pose_sim.captured.session import SENSORS, make_captured_session

DURATION_S = 6.0
REAL_FRAMES = 300
LATE_NS = 100_000_000  # [ns] by which frames of one camera arrive after those of the other

assert_close = partial(np.testing.assert_allclose, rtol=1e-7, atol=1e-7)


@pytest.fixture
def steps(monkeypatch):
    """Numbers of steps by kind; every third of a kind is compared."""
    count = Counter()

    class CheckedFilter(ErrorStateFilter):
        """The compiled filter beside the plain one, which begins each step at the same state."""

        def predict(self, dt_s):
            plain = self._plain("predictions")
            super().predict(dt_s)
            if plain:
                plain.predict(dt_s)
                assert_equal_states(self.state, plain.state)

        def update_with_imus(self, imus, information):
            plain = self._plain("updates with IMUs" if len(imus.links) else "updates without")
            succeeded = super().update_with_imus(imus, information)
            if plain:
                assert_close(information, plain.update_with_imus(imus))
                assert_equal_states(self.state, plain.state)
            return succeeded

        def update_with_frame(self, frame, information):
            plain = self._plain("updates with frames")
            result = super().update_with_frame(frame, information)
            if plain:
                expected, expected_information = plain.update_with_frame(frame)
                assert_close(information, expected_information)
                assert result == pytest.approx(expected, rel=1e-7, nan_ok=True)
                assert_equal_states(self.state, plain.state)
            return result

        def _plain(self, step):
            count[step] += 1
            return ReferenceFilter(self._constants, self.state) if count[step] % 3 == 0 else None

    monkeypatch.setattr(default, "ErrorStateFilter", CheckedFilter)
    return count


def arrival_ns(sample):
    is_late = isinstance(sample, SkeletonSample) and sample.sensor == SENSORS[0]
    return sample.stamp_ns + (LATE_NS if is_late else 0)


def test_on_captured_motion_with_imus_and_late_frames(steps):
    spec = captured_specs(None, held_out=True, seed=11)[0]
    session = make_captured_session(replace(spec, spins=True, duration_s=DURATION_S))
    parameters = PipelineParameters(sensors=SENSORS)
    pipeline = Pipeline(parameters, true_extrinsics(session), is_live=True)
    for sample in sorted(session.samples(imus=True), key=arrival_ns):
        pipeline.add(sample)
    assert pipeline.counters["frames_late_but_used"] > 20
    assert steps["updates with IMUs"] > 50
    assert steps["updates with frames"] > 300


@pytest.mark.data
def test_on_a_real_recording(steps, shared_data):
    name = "Study_5_Kinect_1_Time_1_55_35_PM.csv.gz"
    recorded = read_samples(shared_data / "kinectmultitrack" / name)
    extrinsics = calibrate(recorded.samples, recorded.sensors).extrinsics
    pipeline = Pipeline(PipelineParameters(sensors=extrinsics.sensors), extrinsics)
    run_pipeline(pipeline, recorded.samples[:REAL_FRAMES])
    assert steps["updates with frames"] > 0.8 * REAL_FRAMES
