"""Cells of the accuracy suite, and those on which parameters may be tuned.

A cell is one session: a choreography, a level of difficulty, a seed, and a condition of prior
knowledge. The condition follows from the indices of seed and level (a Latin square), so that each
level and each seed has all three equally often:

    condition = CONDITIONS[(index of the seed + index of the level) mod 3]                  (1)
"""

from collections.abc import Sequence
from dataclasses import dataclass

from pose_bench.sessions import DURATION_S, SessionSpec
from pose_core.errors import InputError
from pose_sim.choreography import CHOREOGRAPHIES

KNOWN, CALIBRATED, OFFSET = "known", "calibrated", "offset"
CONDITIONS = (KNOWN, CALIBRATED, OFFSET)
"""``known``: the true extrinsics; ``calibrated``: estimated from the session's motion; ``offset``:
the same, and the right Kinect's stamps are 80 ms late."""
CLOCK_OFFSET_S = 0.080  # [s]

CALIBRATION_WALK = "walk_about"
"""Choreography for calibrations, not part of the suite."""
MOTIONS = tuple(name for name in CHOREOGRAPHIES if name != CALIBRATION_WALK)

LEVELS = ("easy", "typical", "hard")
TUNING_SEEDS = (1, 2, 3)
JUDGING_SEEDS = (101, 102, 103)
TUNING_CHOREOGRAPHIES = (
    *("leg_lift_march", "squats", "arm_raises", "bow", "turn", "dance"),
    *("twisting", "walk_turns"),  # used to tune the pelvis only
)
"""Motions for tuning, with :data:`TUNING_SEEDS`; the others are held out."""

QUICK_CHOREOGRAPHIES = ("squats", "kicks")
QUICK_DURATION_S = 22.0  # [s]


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One session of the suite."""

    choreography: str
    level: str
    seed: int
    condition: str
    duration_s: float = DURATION_S  # [s]

    @property
    def name(self) -> str:
        """Description of the cell."""
        return f"{self.choreography}, {self.level}, {self.seed}, {self.condition}"

    @property
    def is_seen(self) -> bool:
        """Whether its motion or its seed is used for tuning."""
        return self.choreography in TUNING_CHOREOGRAPHIES or self.seed in TUNING_SEEDS

    @property
    def session(self) -> SessionSpec:
        """The cell's session."""
        return SessionSpec(
            choreography=self.choreography,
            level=self.level,
            seed=self.seed,
            duration_s=self.duration_s,
            clock_offset_s=CLOCK_OFFSET_S if self.condition == OFFSET else 0.0,
        )


def cells(
    choreographies: Sequence[str] = (),
    levels: Sequence[str] = LEVELS,
    seeds: Sequence[int] = JUDGING_SEEDS,
) -> list[Cell]:
    """The suite's cells; all of :data:`MOTIONS` if none are named.

    Raises:
        InputError: If a choreography is unknown.
    """
    for name in choreographies:
        if name not in CHOREOGRAPHIES:
            raise InputError(f"unknown choreography '{name}': expected {', '.join(CHOREOGRAPHIES)}")
    return [
        Cell(
            choreography=choreography,
            level=level,
            seed=seed,
            condition=CONDITIONS[(seed_index + level_index) % len(CONDITIONS)],  # (1)
        )
        for choreography in (choreographies or MOTIONS)
        for level_index, level in enumerate(levels)
        for seed_index, seed in enumerate(seeds)
    ]


def quick_cells() -> list[Cell]:
    """Three short cells, one per condition, for a quick check."""
    first, second = QUICK_CHOREOGRAPHIES
    chosen = ((first, KNOWN), (second, CALIBRATED), (first, OFFSET))
    return [
        Cell(
            choreography=choreography,
            level="typical",
            seed=JUDGING_SEEDS[0],
            condition=condition,
            duration_s=QUICK_DURATION_S,
        )
        for choreography, condition in chosen
    ]
