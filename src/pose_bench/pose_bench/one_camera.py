"""Running an estimator on one real camera, in memory."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pose_core.api import (
    ChosenPerson,
    Pipeline,
    PipelineParameters,
    SkeletonSample,
    SkeletonSeries,
    extrinsics_from_map,
    series_from_samples,
)
from pose_evaluation.offline import MethodRun, run_pipeline
from pose_io.recordings.recording import SensorStream
from pose_io.recordings.stream_frames import samples_of_stream

CAMERA = "camera"
RAW = "raw"
"""Name of the method without estimator: the camera's own skeleton."""
LEVEL_MOUNTING = np.array(
    [[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]]
)
"""``T_map_camera`` of a level camera at a height of 1 m; angles do not depend on it."""


@dataclass(frozen=True, kw_only=True)
class CameraView:
    """One camera's data of one person."""

    samples: tuple[SkeletonSample, ...]  # in order of capture, in the optical frame
    series: SkeletonSeries  # the same

    def shifted(self, shift_ns: int) -> "CameraView":
        """The view with ``shift_ns`` [ns] added to its stamps."""
        return view_of([replace(s, stamp_ns=s.stamp_ns + shift_ns) for s in self.samples])


def view_of(samples: Sequence[SkeletonSample]) -> CameraView:
    """Create a view from samples."""
    return CameraView(samples=tuple(samples), series=series_from_samples(samples))


def view_of_stream(stream: SensorStream) -> CameraView:
    """The only person of a recorded sensor, stamped as by ``kinect_bridge``."""
    return view_of(samples_of_stream(replace(stream, name=CAMERA), ChosenPerson()))


def run_one_camera(estimator: str, samples: Iterable[SkeletonSample]) -> MethodRun:
    """Run an estimator on one camera's samples; the result is in a level ``map``."""
    parameters = PipelineParameters(estimator=estimator, sensors=(CAMERA,), use_imus=False)
    extrinsics = extrinsics_from_map({CAMERA: LEVEL_MOUNTING})
    return run_pipeline(Pipeline(parameters, extrinsics), samples)
