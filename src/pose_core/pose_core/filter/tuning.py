"""Tuning parameters of the default filter.

docs/accuracy/README.md names the data on which they were chosen, and
docs/decisions/tried_without_gain.md the alternatives.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pose_core.errors import InputError
from pose_core.finite_numbers import finite_numbers
from pose_core.plain_yaml import read_yaml

MAY_BE_ZERO = ("carried", "occluded_stddev", "shared_offset_stddev")
"""Parameters that the filter never divides by."""


@dataclass(frozen=True, kw_only=True)
class MotionPrior:
    """Process noise: white accelerations, by kind of link (without its side)."""

    root_acceleration: float = 17.0  # [m/s²]
    acceleration: Mapping[str, float] = field(  # [rad/s²]
        default_factory=lambda: {
            "pelvis": 31.0,
            "trunk": 21.0,
            "head": 46.0,
            "upper_arm": 104.0,
            "forearm": 104.0,
            "thigh": 75.0,
            "shank": 90.0,
        }
    )
    carried: Mapping[str, float] = field(  # [-] share of the parent's acceleration
        default_factory=lambda: {
            "pelvis": 0.0,
            "trunk": 0.6,
            "head": 0.0,
            "upper_arm": 0.1,
            "forearm": 0.22,
            "thigh": 0.45,
            "shank": 0.13,
        }
    )
    rate_memory: float = 0.1  # [s] time constant with which rates decay
    one_camera_rate_memory: float = 0.05  # [s] the same with a single camera
    slide_stddev: Mapping[str, float] = field(  # [m] of the joints that slide, without their side
        default_factory=lambda: {"shoulder": 0.015, "hip": 0.0089, "knee": 0.0105, "foot": 0.0105}
    )
    slide_memory: float = 0.5  # [s]


@dataclass(frozen=True, kw_only=True)
class CameraNoise:
    """Measurement noise of a skeleton tracker's joints, offsets and delay.

    The noise is 1.5 times as large as the errors are, since these are correlated in time.
    """

    stddev: float = 0.03  # [m] of a visible joint of usual trackers, see filter.view_noise
    inferred_stddev: float = 0.24  # [m] in addition for an inferred joint, whose errors last
    occluded_stddev: float = 0.15  # [m] in addition under self-occlusion
    student_dof: float = 3.0  # [-] of Student's t of a joint's residual
    least_weight: float = 0.02  # [-] lower bound of a joint's weight
    offset_stddev: float = 0.012  # [m] of a view's slowly varying offset of a joint
    offset_memory: float = 3.6  # [s]
    shared_offset_stddev: float = 0.012  # [m] of a joint's offset that all views share
    delay_prior: float = 10.0  # [m²/s²] weight of the known delay, as a sum of squared speeds
    delay_memory: float = 30.0  # [s]
    nis_memory: float = 0.05  # [s] over which the NIS is smoothed, for finding contradicted links


@dataclass(frozen=True, kw_only=True)
class PosturePrior:
    """Soft constraints on the posture, with each frame, or with the IMUs while no camera sends."""

    hinge_stddev: float = 0.9  # [rad] of elbows and knees, out of their plane
    twist_stddev: Mapping[str, float] = field(  # [rad] of a link about its own axis
        default_factory=lambda: {"upper_arm": 1.8, "thigh": 1.4, "head": 1.8}
    )
    waist_stddev: tuple[float, float, float] = (0.25, 0.3, 0.5)  # [rad] sideways, forward, turn
    waist_mean_stddev: tuple[float, float] = (0.03, 0.05)  # [rad] sideways, turn, over a minute
    wrong_bend: float = 0.6  # [rad] backward bend from which a limb is rotated by half a turn


@dataclass(frozen=True, kw_only=True)
class ImuNoise:
    """Measurement noise of aligned IMUs, and random walk of their alignment."""

    orientation_stddev: float = 0.02  # [rad] of its link's axes
    spine_bend: Mapping[str, float] = field(  # [rad] about the lateral axis: the spine also bends
        default_factory=lambda: {"pelvis": 0.2, "trunk": 0.15}  # between the joints that are seen
    )
    spine_bend_rate: Mapping[str, float] = field(  # [rad/s] of the gyroscope about the same axis
        default_factory=lambda: {"pelvis": 2.0}
    )
    soft_tissue: float = 0.0067  # [s] in addition for each unit of angular rate, up to 6 rad/s
    correlated_samples: float = 6.0  # [-] samples that count as one
    student_dof: float = 8.0  # [-]
    least_weight: float = 0.001  # [-] lower bound of an IMU's weight
    rate_stddev: float = 0.1  # [rad/s] of the gyroscope on its segment
    strap_swing: Mapping[str, float] = field(  # [-] of links, by which IMUs lag or lead, to others'
        default_factory=lambda: {"thigh": 2.0, "forearm": 0.6}
    )
    usual_correlation: Mapping[str, float] = field(  # [-] see pose_core.filter.imu_noise
        default_factory=lambda: {
            "trunk": 0.35,
            "head": 0.35,
            "upper_arm": 0.5,
            "forearm": 0.5,
            "thigh": 0.2,
            "shank": 0.2,
        }
    )
    alignment_walk: float = 0.0006  # [rad/√s]
    heading_walk: float = 0.006  # [rad/√s]
    heading_drift: float = 0.005  # [rad/s] of a gyroscope's bias without a magnetometer
    heading_drift_walk: float = 0.0001  # [rad/s/√s]


@dataclass(frozen=True, kw_only=True)
class StartNoise:
    """Initial standard deviations."""

    position: float = 0.03  # [m]
    rotation: float = 0.15  # [rad]
    velocity: float = 0.2  # [m/s]
    rate: float = 0.5  # [rad/s]
    depth_error: float = 0.015  # [m] of a view, see pose_core.filter.depth_errors
    depth_noise: float = 0.02  # [m] of its joints


@dataclass(frozen=True, kw_only=True)
class FilterTuning:
    """All tuning parameters."""

    motion: MotionPrior = field(default_factory=MotionPrior)
    camera: CameraNoise = field(default_factory=CameraNoise)
    posture: PosturePrior = field(default_factory=PosturePrior)
    imu: ImuNoise = field(default_factory=ImuNoise)
    start: StartNoise = field(default_factory=StartNoise)
    arm_length: float = 0.99  # [-] of the measured: noise lengthens bones, and flexes long arms

    def for_cameras(self, cameras: int) -> "FilterTuning":
        """The parameters for a number of cameras.

        A single real tracker holds a joint back and then catches up; rates that last long carry
        the estimate beyond it.
        """
        if cameras != 1:
            return self
        motion = replace(self.motion, rate_memory=self.motion.one_camera_rate_memory)
        return replace(self, motion=motion)


def load_tuning(path: str) -> FilterTuning:
    """Read a YAML file of the parameters that differ from the default, nested as they are here.

    Args:
        path: The file; empty: the default.

    Raises:
        InputError: If it cannot be read, or has an unknown parameter or an impossible value.
    """
    if not path:
        return FilterTuning()
    changes = read_yaml(Path(path).expanduser(), "the filter's tuning")
    tuning: FilterTuning = _changed(FilterTuning(), changes, f"{path}: tuning")
    return tuning


def _changed(default: Any, value: Any, where: str) -> Any:
    """A group of parameters, or a single one, with the value of a file."""
    known = vars(default) if is_dataclass(default) else default
    if isinstance(known, Mapping):
        if not isinstance(value, Mapping):
            raise InputError(f"{where} is {value!r}, expected some of {', '.join(known)}")
        if unknown := ", ".join(sorted(map(str, value.keys() - known.keys()))):
            raise InputError(f"{where} has {unknown}, expected some of {', '.join(known)}")
        changes = {name: _changed(known[name], value[name], f"{where}/{name}") for name in value}
        return {**default, **changes} if known is default else replace(default, **changes)
    shape = np.shape(default)
    numbers = None if isinstance(value, bool) else finite_numbers(value, *shape)
    may_be_zero = not set(MAY_BE_ZERO).isdisjoint(where.rpartition(":")[2].split("/"))
    if numbers is None or (numbers < 0.0).any() or not (may_be_zero or numbers.all()):
        expected = f"{shape[0]} positive numbers" if shape else "a positive number"
        raise InputError(f"{where} is {value!r}, expected {expected}")
    return tuple(numbers.tolist()) if shape else float(numbers)
