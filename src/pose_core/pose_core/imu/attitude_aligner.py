"""Sensor-to-segment alignment for estimators that do not have it in their state."""

from collections.abc import Mapping

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.body.model import BodyModel
from pose_core.imu.imu_history import ImuMeasurements
from pose_core.imu.imu_use import ImuUse
from pose_core.imu.sensor_alignment import Alignment, SegmentAlignment
from pose_core.imu.sensor_to_segment import SensorToSegment
from pose_core.kernels.rotations import exponential
from pose_core.stamps import NS_PER_S

SOLVE_PERIOD_NS = NS_PER_S // 2
AXIS_STDDEV, TURN_STDDEV = 0.15, 0.5  # [rad] of an estimated link: of its axis, about its axis
MAX_STEP_S = 0.1  # [s] upper bound of the time that one instant stands for


class AttitudeAligner:
    """Aligns IMUs with the links of any estimator, and continuously refines the alignment.

    Args:
        model: The body model, which maps segments to links.
    """

    def __init__(self, model: BodyModel) -> None:
        self._model = model
        self._alignments: dict[str, SegmentAlignment] = {}
        self._found: dict[str, Alignment] = {}
        self._uses: dict[str, ImuUse] = {}
        self._R_world_first: dict[str, FloatArray] = {}  # each IMU's first orientation, (3, 3)
        self._sensor_to_segment: Mapping[str, SensorToSegment] = {}
        self._observed_ns: int | None = None
        self._solved_ns = 0
        self._instants = 0

    @property
    def uses(self) -> tuple[ImuUse, ...]:
        """State of use of each IMU with samples."""
        for use in self._uses.values():
            use.frames = self._instants
        return tuple(self._uses[name] for name in sorted(self._uses))

    def use_sensor_to_segment(self, alignments: Mapping[str, SensorToSegment]) -> None:
        """Use sensor-to-segment rotations of a calibration."""
        self._sensor_to_segment = alignments

    def observe(self, stamp_ns: int, imus: ImuMeasurements, R_map_links: FloatArray) -> None:
        """Update the alignment with one instant.

        Args:
            stamp_ns: The instant [ns].
            imus: Measurements of all IMUs.
            R_map_links: The estimator's link rotations from cameras only, (links, 3, 3).
        """
        before_ns, self._observed_ns = self._observed_ns, stamp_ns
        if before_ns is None or stamp_ns <= before_ns:
            return
        dt_s = min((stamp_ns - before_ns) / NS_PER_S, MAX_STEP_S)
        for row, segment in enumerate(imus.segments):
            use = self._uses.setdefault(segment, ImuUse(segment=segment))
            link = self._model.segments.get(segment)
            use.has_link = link is not None
            if link is None:
                continue
            R = R_map_links[self._model.link_index[link]]
            covariance = R @ np.diag(np.square([AXIS_STDDEV, AXIS_STDDEV, TURN_STDDEV])) @ R.T
            own = self._alignments.setdefault(segment, SegmentAlignment())
            R_world_sensor, rate = imus.R_world_sensor[row], imus.angular_velocity[row]
            first = self._R_world_first.setdefault(segment, R_world_sensor.copy())
            use.note_orientation(first, R_world_sensor)
            own.observe(dt_s, R_world_sensor, R, covariance, rate)
        if stamp_ns - self._solved_ns >= SOLVE_PERIOD_NS:
            self._solved_ns = stamp_ns
            for segment, own in self._alignments.items():
                self._solve(stamp_ns, segment, own)

    def _solve(self, stamp_ns: int, segment: str, own: SegmentAlignment) -> None:
        use, found = self._uses[segment], own.solve(self._sensor_to_segment.get(segment))
        use.does_not_fit = own.does_not_fit
        if found is None:
            return
        self._found[segment] = found
        if not use.is_aligned:
            use.note_aligned(stamp_ns)
        use.note_variance(np.diag(found.covariance))

    def attitudes(self, imus: ImuMeasurements) -> dict[str, FloatArray]:
        """Attitudes ``R_map_segment`` of the segments by the aligned IMUs, (3, 3)."""
        attitudes = {}
        self._instants += 1
        for row, segment in enumerate(imus.segments):
            found = self._found.get(segment)
            if found is not None:
                self._uses[segment].frames_used += 1
                R_z = np.empty((3, 3))
                exponential(0.0, 0.0, found.heading, R_z)
                attitudes[segment] = R_z @ imus.R_world_sensor[row] @ found.R_sensor_link
        return attitudes
