"""An estimator that is fed with one real camera, in memory."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pose_bench.methods import TimedRun, run_pipeline
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.pipeline import FusionPipeline
from pose_core.session.extrinsics import Extrinsics, extrinsics_from_map
from pose_core.streams.samples import SkeletonSample
from pose_core.streams.series import SkeletonSeries, series_from_samples
from pose_core.streams.single_person import SinglePersonSelector
from pose_io.recordings.recording import SensorStream
from pose_io.recordings.timeline import make_timeline

CAMERA = "camera"
RAW = "raw"
"""What stands for no estimator at all: the camera's own skeleton."""
LEVEL_MOUNTING = np.array(
    [[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]]
)
"""``T_map_camera`` of a camera that looks straight ahead from 1 m; angles do not depend on it."""


@dataclass(frozen=True, kw_only=True)
class View:
    """What one camera saw of one person."""

    samples: tuple[SkeletonSample, ...]  # in order of capture, in the optical frame
    series: SkeletonSeries  # the same

    def shifted(self, shift_ns: int) -> "View":
        """The view with ``shift_ns`` [ns] added to its stamps."""
        return view_of([replace(s, stamp_ns=s.stamp_ns + shift_ns) for s in self.samples])


def view_of(samples: Sequence[SkeletonSample]) -> View:
    """A view of samples."""
    return View(samples=tuple(samples), series=series_from_samples(samples))


def view_of_stream(stream: SensorStream) -> View:
    """The only person that a recorded sensor saw, stamped as ``kinect_bridge`` does."""
    timeline = make_timeline(stream)
    selector = SinglePersonSelector()
    samples = []
    for frame, time_ns in zip(timeline.frame.tolist(), timeline.time_ns.tolist(), strict=True):
        persons = [
            SkeletonSample(
                stamp_ns=time_ns,
                sensor=CAMERA,
                person=stream.person[row],
                positions=stream.positions[row],
                tracking_state=stream.tracking_state[row],
            )
            for row in stream.rows(frame)
        ]
        chosen = selector.select(persons)
        if chosen is not None:
            samples.append(chosen)
    return view_of(samples)


def run_one_camera(estimator: str, samples: Iterable[SkeletonSample]) -> TimedRun:
    """Run an estimator on one camera's samples; its joints are in a level ``map``."""
    parameters = FusionParameters(estimator=estimator, sensors=(CAMERA,), use_imus=False)
    extrinsics: Extrinsics = extrinsics_from_map({CAMERA: LEVEL_MOUNTING})
    pipeline = FusionPipeline(parameters, extrinsics)
    return run_pipeline(pipeline, ((sample.stamp_ns, sample) for sample in samples))
