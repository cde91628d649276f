"""The synthetic subject's sessions as the samples that the live bridges would publish, in memory.

Stamps are computed by the code of the live graph: ``pose_io.recordings.timeline`` maps each
Kinect's clock onto the host's; ``imu_bridge.pipeline`` decodes the nodes' bytes, maps their clocks,
removes the gyroscopes' biases and runs the bridge's default filter. Samples are in the order of
their arrival at the host.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pose_bench.imu_samples import FILTER, imu_samples
from pose_core.api import (
    Clock,
    Extrinsics,
    ImuSample,
    SkeletonSample,
    SkeletonSeries,
    extrinsics_from_map,
)
from pose_evaluation.offline import tracked_series
from pose_io.recordings.stream_frames import frames_of_stream
from pose_sim.captured.session import START_NS
from pose_sim.motion import GRID_RATE
from pose_sim.session import Session, make_session, settings_of
from pose_sim.session_folder import as_recording

TRUTH_ROWS = slice(None, None, round(GRID_RATE / 100.0))  # 100 Hz
DURATION_S = 40.0  # [s]
EVALUATED_FROM_S = 16.0  # [s] end of the warm-up, which is common to all choreographies


@dataclass(frozen=True, kw_only=True)
class SessionSpec:
    """Definition of a session."""

    choreography: str
    level: str  # a noise preset of pose_sim: easy, typical, hard, clean
    seed: int
    duration_s: float = DURATION_S  # [s]
    clock_offset_s: float = 0.0  # [s] delay of the right Kinect's stamps


@dataclass(frozen=True, kw_only=True)
class BenchSession:
    """The sensors' samples in one session, and the ground truth."""

    skeletons: tuple[SkeletonSample, ...]  # in order of arrival
    imus: tuple[ImuSample, ...]  # in order of arrival; empty if not requested
    samples: tuple[SkeletonSample | ImuSample, ...]  # both, in order of arrival
    arrivals_ns: tuple[int, ...]  # [ns] arrival of each of the samples at the host
    truth: SkeletonSeries  # in map, at 100 Hz
    extrinsics: Extrinsics  # the true ones, with the true clock offset

    @property
    def evaluated_truth(self) -> SkeletonSeries:
        """The truth of the choreography itself: without standing still and the warm-up."""
        from_ns = START_NS + round(EVALUATED_FROM_S * 1e9)
        return self.truth.between(from_ns, int(self.truth.stamps_ns[-1]))


def bench_session(
    spec: SessionSpec,
    *,
    imus: bool = True,
    overrides: Mapping[str, Any] | None = None,
    imu_filter: str = FILTER,
) -> BenchSession:
    """Simulate a session's samples; the same arguments give the same samples.

    Args:
        spec: The session.
        imus: Whether to simulate the IMUs' samples too.
        overrides: Parameters of ``pose_sim`` by section and name, beyond the level's.
        imu_filter: The bridge's orientation filter.

    Raises:
        InputError: If there is no such choreography or level.
    """
    sections = {name: dict(values) for name, values in (overrides or {}).items()}
    sections.setdefault("kinect", {})["clock_offset"] = spec.clock_offset_s
    settings = settings_of(spec.level, sections)
    session = make_session(spec.choreography, spec.duration_s, spec.seed, settings)
    timed_skeletons = _skeleton_samples(session)
    timed_imus = imu_samples(session, imu_filter) if imus else []
    every: list[tuple[int, SkeletonSample | ImuSample]] = [*timed_skeletons, *timed_imus]
    every.sort(key=lambda timed: timed[0])
    return BenchSession(
        skeletons=tuple(sample for _, sample in timed_skeletons),
        imus=tuple(sample for _, sample in timed_imus),
        samples=tuple(sample for _, sample in every),
        arrivals_ns=tuple(arrival_ns for arrival_ns, _ in every),
        truth=_truth(session),
        extrinsics=_true_extrinsics(session),
    )


def _skeleton_samples(session: Session) -> list[tuple[int, SkeletonSample]]:
    """Arrival [ns] and sample of every frame of both Kinects, in order of arrival."""
    timed = []
    for stream in as_recording(session).streams:
        for frame, _, persons in frames_of_stream(stream):
            arrival_ns = START_NS + int(stream.host_time_ns[frame])
            timed += [
                (arrival_ns, replace(one, stamp_ns=START_NS + one.stamp_ns)) for one in persons
            ]
    return sorted(timed, key=lambda each: each[0])


def _truth(session: Session) -> SkeletonSeries:
    times = session.motion.times[TRUTH_ROWS]
    stamps_ns = START_NS + np.rint(times * 1e9).astype(np.int64)
    return tracked_series(stamps_ns, session.motion.pose.joints[TRUTH_ROWS])


def _true_extrinsics(session: Session) -> Extrinsics:
    late = Clock(offset_ns=round(session.settings.kinect.clock_offset * 1e9))
    placed = extrinsics_from_map(session.sensor_poses)
    return replace(placed, clocks={n: late for n in placed.sensors if n != placed.reference})
