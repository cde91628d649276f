"""Evaluation of a fault's effect on the joint states against the truth, with bounds."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pose_bench.faults.fault import Fault
from pose_core.api import SkeletonSeries, joint_angles, without_sideways_flexion, wrapped
from pose_core.arrays import FloatArray, rows_of, unit_vectors
from pose_core.joints import JOINT_INDEX, LIMB_ENDS
from pose_core.stamps import NS_PER_S
from pose_io.arrays import IntArray
from pose_node.node_status import NodeStatus

RECOVERY_S = 5.0  # [s] evaluated after a fault
MAX_STEP_DEG = 10.0  # [deg] largest step between messages, beyond the truth's own
MAX_RATIO = 2.0  # [-] largest ratio of the RMSE to that without the lost sources
MAX_SAID_S, MAX_RECOVERY_S = 1.0, 3.0
AHEAD_NS = 2_000_000  # [ns] by which a stamp may be ahead of its arrival, as clocks are read twice
GAP_NS = 300_000_000  # [ns] after a longer gap, steps are not evaluated
BONES = [*LIMB_ENDS.values(), ("torso", "neck"), ("left_hip", "right_hip")]


@dataclass(frozen=True, kw_only=True)
class Poses:
    """n messages of one topic."""

    stamps_ns: IntArray  # (n,)
    arrived_ns: IntArray  # (n,)
    values: FloatArray  # (n, joints) [rad], or (n, 15, 3) [m]

    def between(self, begin_ns: int, end_ns: int) -> "Poses":
        """The messages that arrived in an interval [ns]."""
        return rows_of(self, (self.arrived_ns >= begin_ns) & (self.arrived_ns < end_ns))


@dataclass(frozen=True, kw_only=True)
class Heard:
    """All received messages."""

    joints: Poses
    bodies: Poses
    said: Sequence[NodeStatus]


@dataclass(frozen=True, kw_only=True)
class FaultResult:
    """Result of one fault."""

    fault: Fault
    step_deg: float
    ahead: int
    backwards: int
    repeated: int
    rmse_deg: float  # NaN if nothing was published
    reference_deg: float  # undisturbed, without the lost sources
    said_s: float  # [s] after the fault's start; NaN if never
    said: str
    recovery_s: float  # [s] after the fault's end; inf if not within the evaluated time
    longest_gap_s: float

    @property
    def broken(self) -> tuple[str, ...]:
        """The violated bounds."""
        fault = self.fault
        holds = {
            "step": self.step_deg <= MAX_STEP_DEG,
            "ahead": self.ahead == 0,
            "backwards": self.backwards == 0,
            "repeated": self.repeated == 0,
            "RMSE": fault.silent or self.rmse_deg <= MAX_RATIO * self.reference_deg,
            "said": not fault.said or self.said_s <= MAX_SAID_S,
            "recovery": self.recovery_s <= MAX_RECOVERY_S,
        }
        return tuple(name for name, does in holds.items() if not does)


def judge(
    fault: Fault, heard: Heard, truth: SkeletonSeries, reference: Poses, begin_ns: int
) -> FaultResult:
    """Evaluate one fault.

    Args:
        fault: The fault.
        heard: All messages received in the session.
        truth: Ground truth of the session.
        reference: Bodies fused from the undisturbed samples without the lost sources.
        begin_ns: Start of the fault [ns].
    """
    end_ns = begin_ns + round(fault.lasts_s * NS_PER_S)
    over_ns = end_ns + round(RECOVERY_S * NS_PER_S)
    joints = heard.joints.between(begin_ns, over_ns)
    steps_ns = np.diff(joints.stamps_ns)
    said_s, said = _said(fault, heard.said, begin_ns, over_ns)
    arrivals = np.concatenate([[begin_ns], joints.arrived_ns, [over_ns]])
    return FaultResult(
        fault=fault,
        step_deg=_step_deg(joints, truth),
        ahead=int(np.sum(joints.stamps_ns > joints.arrived_ns + AHEAD_NS)),
        backwards=int(np.sum(steps_ns < 0)),
        repeated=int(np.sum(steps_ns == 0)),
        rmse_deg=rmse_deg(heard.bodies.between(begin_ns, end_ns), truth),
        reference_deg=rmse_deg(reference.between(begin_ns, end_ns), truth),
        said_s=said_s,
        said=said,
        recovery_s=_recovery_s(heard.bodies, reference, truth, end_ns),
        longest_gap_s=float(np.diff(arrivals).max()) / NS_PER_S,
    )


def errors_deg(bodies: Poses, truth: SkeletonSeries) -> FloatArray:
    """Errors of the twelve angles, (n, 12) [deg]; NaN where they are undefined."""
    if not len(bodies.stamps_ns):
        return np.empty((0, 12))
    found = joint_angles(bodies.values)
    expected = without_sideways_flexion(joint_angles(truth.at(bodies.stamps_ns)))
    errors = [np.degrees(wrapped(found[name] - expected[name])) for name in expected]
    return np.stack(errors, axis=1)


def rmse_deg(bodies: Poses, truth: SkeletonSeries) -> float:
    """RMSE over all angles and instants [deg]; NaN if there are none."""
    squares = errors_deg(bodies, truth) ** 2
    return float(np.sqrt(np.nanmean(squares))) if np.isfinite(squares).any() else float("nan")


def _step_deg(joints: Poses, truth: SkeletonSeries) -> float:
    """Largest step of an angle [deg] beyond the true rotation of a bone in the same time."""
    if len(joints.stamps_ns) < 2:
        return 0.0
    steps = np.degrees(np.abs(wrapped(np.diff(joints.values, axis=0)))).max(axis=1)
    positions = truth.at(joints.stamps_ns)
    ends = np.array([[JOINT_INDEX[a], JOINT_INDEX[b]] for a, b in BONES])
    bones = unit_vectors(positions[:, ends[:, 1]] - positions[:, ends[:, 0]])
    cosine = np.clip(np.sum(bones[1:] * bones[:-1], axis=2), -1.0, 1.0)
    own = np.degrees(np.arccos(cosine)).max(axis=1)
    near = np.diff(joints.arrived_ns) < GAP_NS
    return float(np.nanmax((steps - own)[near], initial=0.0))  # NaN where the truth ends


def _said(
    fault: Fault, said: Sequence[NodeStatus], begin_ns: int, over_ns: int
) -> tuple[float, str]:
    """Time [s] and text of the first new warning with one of the words."""
    known = {one.name: one.message for one in said if one.received_ns < begin_ns}
    for one in said:
        is_meant = one.level > 0 and any(word in one.message for word in fault.said)
        is_new = begin_ns <= one.received_ns < over_ns and known.get(one.name) != one.message
        if is_meant and is_new:
            return (one.received_ns - begin_ns) / NS_PER_S, f"{one.name}: {one.message}"
    return float("nan"), ""


def _recovery_s(bodies: Poses, reference: Poses, truth: SkeletonSeries, end_ns: int) -> float:
    """Time [s] after which the error of each half second is at most twice the undisturbed one."""
    half_ns = NS_PER_S // 2
    recovered = float("inf")
    for k in reversed(range(round(RECOVERY_S * 2))):
        begin_ns = end_ns + k * half_ns
        found = rmse_deg(bodies.between(begin_ns, begin_ns + half_ns), truth)
        expected = rmse_deg(reference.between(begin_ns, begin_ns + half_ns), truth)
        if not found <= MAX_RATIO * expected + 1.0:  # or NaN; 1 deg for half a second's scatter
            return recovered
        recovered = 0.5 * k
    return recovered
