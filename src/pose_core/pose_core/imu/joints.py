"""The turns between IMUs' worlds that the joints between their segments show, seen or not."""

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_core.joints import SIDES
from pose_core.kernels.compiling import settled
from pose_core.kernels.joint_series import INTERVAL_NS, make_joint_series, take_forces
from pose_core.kernels.joint_turns import WINDOW, make_joint_turns, take_windows
from pose_core.streams.samples import ImuBlock

JOINTS: tuple[tuple[str, str], ...] = (
    ("torso", "head"),
    ("torso", "pelvis"),
    *(
        (parent.format(side=side), f"{side}_{child}")
        for side in SIDES
        for parent, child in (
            ("torso", "upper_arm"),
            ("{side}_upper_arm", "forearm"),
            ("pelvis", "thigh"),
            ("torso", "thigh"),
            ("{side}_thigh", "shank"),
            ("{side}_shank", "foot"),
        )
    ),
)
"""Neighbours: parent and child. A thigh's parent is the pelvis, where that wears an IMU."""

WINDOW_NS = WINDOW * INTERVAL_NS
LATENESS_NS = 1_000_000_000  # after a window's end, when its turn is used: by then it is known
BACK_NS = 4 * WINDOW_NS  # no joint is as far behind another
ROUND_NS = 250_000_000  # of samples that are taken together, which is quicker
MOST_BLOCKS = 256  # that wait for it
MOST_WAITING = 4096  # turns


@dataclass(frozen=True, kw_only=True)
class JointTurn:
    """What a joint shows in one window."""

    parent: str
    child: str
    until_ns: int  # [ns] the window's end
    turn: float  # [rad] the child's heading less the parent's
    variance: float  # [rad²] of what is not alike from one window to the next
    noise: float  # [-] variance of what was felt of the joint, against its motion


class ImuJoints:
    """Follows the joints between the segments that wear IMUs."""

    def __init__(self) -> None:
        names = sorted({name for joint in JOINTS for name in joint})
        self._rows = {name: row for row, name in enumerate(names)}
        self._take_forces, self._take_windows = settled(take_forces), settled(take_windows)
        self._series = make_joint_series(len(names))
        pairs = [[self._rows[name] for name in joint] for joint in JOINTS]
        self._joints = make_joint_turns(np.array(pairs, np.int64))
        self._whole = np.zeros((3 * len(JOINTS), 2), np.int64)
        self._found = np.zeros((3 * len(JOINTS), 3))
        self._asked: dict[tuple[str, ...], NDArray[np.int64]] = {}
        self._blocks: list[ImuBlock] = []
        self._round = -1
        self._waiting = deque[JointTurn](maxlen=MOST_WAITING)

    def add(self, block: ImuBlock) -> None:
        """Take samples; of segments that no joint connects, and without accelerations, nothing."""
        if not len(block):
            return
        self._blocks.append(block)
        is_round_over = int(block.stamps_ns[-1]) // ROUND_NS != self._round
        if is_round_over or len(self._blocks) > MOST_BLOCKS:
            self._round = int(block.stamps_ns[-1]) // ROUND_NS
            self._take_blocks()

    def _take_blocks(self) -> None:
        blocks = self._blocks
        self._take_forces(
            self._series,
            np.concatenate([self._rows_of(block.segments)[block.imu] for block in blocks]),
            np.concatenate([block.stamps_ns for block in blocks]),
            np.concatenate([block.orientation for block in blocks]),
            np.concatenate([block.linear_acceleration for block in blocks]),
        )
        blocks.clear()
        self._fit()

    def until(self, stamp_ns: int) -> list[JointTurn]:
        """The turns of the windows up to an instant [ns], each once; in an order of their own."""
        turns, limit_ns = [], stamp_ns - LATENESS_NS
        while self._waiting and self._waiting[0].until_ns <= limit_ns:
            turns.append(self._waiting.popleft())
        # Which IMU spoke first must not show, not even in rounding.
        return sorted(turns, key=lambda each: (each.until_ns, each.child, each.parent))

    def forget(self, segment: str) -> None:
        """What waits is of before an IMU began anew."""
        if self._blocks:
            self._take_blocks()
        kept = [each for each in self._waiting if segment not in (each.parent, each.child)]
        self._waiting = deque(kept, maxlen=MOST_WAITING)

    def _fit(self) -> None:
        count = self._take_windows(self._joints, self._series, self._whole, self._found)
        is_pelvis_worn = self._series.stamps_ns[self._rows["pelvis"]] > 0
        for (joint, window), (turn, variance, noise) in zip(
            self._whole[:count].tolist(), self._found[:count].tolist(), strict=True
        ):
            parent, child = JOINTS[joint]
            if is_pelvis_worn and parent == "torso" and child.endswith("thigh"):
                continue
            until_ns = (window + 1) * WINDOW_NS
            if self._waiting and until_ns < self._waiting[-1].until_ns - BACK_NS:
                self._waiting.clear()  # the clock was set back
            self._waiting.append(
                JointTurn(
                    parent=parent,
                    child=child,
                    until_ns=until_ns,
                    turn=turn,
                    variance=variance,
                    noise=noise,
                )
            )

    def _rows_of(self, segments: tuple[str, ...]) -> NDArray[np.int64]:
        rows = self._asked.get(segments)
        if rows is None:
            rows = np.array([self._rows.get(name, -1) for name in segments], np.int64)
            self._asked[segments] = rows
        return rows
