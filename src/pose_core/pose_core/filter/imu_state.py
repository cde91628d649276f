"""What a filter state says of one IMU: its alignment, north, whether cameras contradict it."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.filter.layout import rotation_column
from pose_core.filter.state import FilterState
from pose_core.filter.worn_imus import WornImu
from pose_core.imu.sensor_to_segment import SensorToSegment
from pose_core.stamps import NS_PER_S

UNCHECKED_NS = NS_PER_S // 10  # [ns] over a longer gap, no gyroscope checks the orientation
RESTARTED_NS = 3 * NS_PER_S // 10  # [ns] over a longer gap, a device may have restarted
RESTRAPPED_NS = 2 * NS_PER_S  # [ns] over a longer one, it may have been strapped on anew
CONTRADICTED_S = 0.25  # [s] of contradiction by the cameras after which an IMU is realigned
STRAP_WALK = np.radians(3.0)  # [rad/s] of the sensor-to-segment rotation in a gap
MAX_STRAP_WALK = np.radians(12.0)  # [rad]
RESTARTED_TURN = np.radians(60.0)  # [rad] of a link by its IMU against the filter after a gap
TURN_DEVIATIONS = 3.0  # [-] of the link's own rotation that such a turn exceeds
MIN_OTHERS = 2  # [-] aligned IMUs required to agree on north
MIN_AGREEING = 4  # [-] aligned IMUs required to contradict each other about north
MAX_MEDIAN_DEVIATION = 0.6  # [rad] median deviation of their headings from the mean


def alignment_of(worn: WornImu, state: FilterState, *, z_down: bool) -> SensorToSegment:
    """The filter's estimate of an aligned IMU's alignment."""
    column = int(state.imus.column[worn.link])
    variance = np.diag(state.P)[column : column + 3]
    return SensorToSegment(
        R_sensor_segment=state.imus.R_sensor_link[worn.link].copy(),
        stddev=np.sqrt(np.maximum(variance, 0.0)),
        exchanged_with=worn.use.exchanged_with,
        z_down=z_down,
    )


def after_gap(alignment: SensorToSegment, gap_ns: int) -> SensorToSegment:
    """An alignment after a gap, in which the sensor may have been moved."""
    moved = min(STRAP_WALK * gap_ns / NS_PER_S, MAX_STRAP_WALK)
    return replace(alignment, stddev=np.hypot(alignment.stddev, moved))


def must_be_realigned(
    worn: WornImu,
    gap_ns: int,
    R_world_sensor: FloatArray,
    imus: Iterable[WornImu],
    state: FilterState,
) -> bool:
    """Whether an IMU has to be realigned after a gap: its world or its place may have changed.

    Args:
        worn: The IMU.
        gap_ns: Time since its last sample [ns].
        R_world_sensor: Its orientation after the gap, (3, 3).
        imus: All IMUs.
        state: State of the filter, predicted over the gap.
    """
    return (
        gap_ns > RESTRAPPED_NS
        or (gap_ns > RESTARTED_NS and not knows_north(worn, imus, state))
        or (gap_ns > UNCHECKED_NS and has_turned(worn, R_world_sensor, state))
    )


def has_turned(worn: WornImu, R_world_sensor: FloatArray, state: FilterState) -> bool:
    """Whether an aligned IMU is turned by more than its link can have turned in a short gap.

    Args:
        worn: The IMU.
        R_world_sensor: Its orientation after the gap, (3, 3).
        state: State of the filter, predicted over the gap.
    """
    if not worn.use.is_aligned:
        return False
    cosine, sine = np.cos(state.imus.heading[worn.link]), np.sin(state.imus.heading[worn.link])
    R_map_world = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    measured = R_map_world @ R_world_sensor @ state.imus.R_sensor_link[worn.link]
    turned = np.arccos(
        np.clip(0.5 * (np.trace(measured.T @ state.pose.rotations[worn.link]) - 1.0), -1.0, 1.0)
    )
    first = rotation_column(worn.link)
    variance = np.diag(state.P)[first : first + 3].sum()
    return bool(turned > max(RESTARTED_TURN, TURN_DEVIATIONS * np.sqrt(variance)))


def knows_north(worn: WornImu, imus: Iterable[WornImu], state: FilterState) -> bool:
    """Whether an IMU says that it knows north, and the aligned ones that do are not at odds."""
    headings = _headings_by_north(imus, state)
    is_shared = len(headings) < MIN_AGREEING or _mean_heading(headings) is not None
    return worn.says_north and is_shared


def _headings_by_north(imus: Iterable[WornImu], state: FilterState) -> list[float]:
    """Headings [rad] of the aligned IMUs that say that they know north."""
    return [
        state.imus.heading[each.link] for each in imus if each.use.is_aligned and each.says_north
    ]


def _mean_heading(headings: Sequence[float]) -> float | None:
    """Mean of headings [rad]; None if most differ from it."""
    mean = np.angle(np.exp(1j * np.array(headings)).sum())
    apart = np.abs(np.angle(np.exp(1j * (np.array(headings) - mean))))
    return float(mean) if np.median(apart) < MAX_MEDIAN_DEVIATION else None


def north_of(worn: WornImu, imus: Iterable[WornImu], state: FilterState) -> float | None:
    """Heading [rad] of the world common to an IMU and the aligned ones; None if unknown."""
    others = _headings_by_north(imus, state)
    if not worn.says_north or len(others) < MIN_OTHERS:
        return None
    return _mean_heading(others)


def is_contradicted(
    worn: WornImu, imus: Iterable[WornImu], parents: NDArray[np.int64], state: FilterState
) -> bool:
    """Whether the cameras contradict an IMU, and not an aligned one on the parent link."""
    if state.imus.contradicted_s[worn.link] < CONTRADICTED_S:
        return False
    above = parents[worn.link]
    has_imu = any(each.link == above and each.use.is_aligned for each in imus)
    return not (has_imu and state.imus.contradicted_s[above] > 0.5 * CONTRADICTED_S)
