"""Instructions to the person during the calibration of the IMUs."""

from collections.abc import Mapping, Sequence

import numpy as np

from pose_core.api import SensorToSegment

MOVES = {
    "thigh": "lift the {side}knee to the front, then the leg to the side",
    "shank": "lift the {side}knee, and kick the heel back",
    "upper_arm": "raise the {side}arm to the front, then to the side",
    "forearm": "raise the {side}arm and bend the elbow",
    "torso": "lean forward, then turn to both sides",
    "pelvis": "bow forward from the hips, then turn to both sides",
    "head": "nod, then look to both sides",
}
TURN_UNSEEN = ("forearm", "torso", "pelvis", "head")
"""Segments whose rotation about the long axis comes from the N-pose: motion hardly improves it."""


def wanted_stddev(segment: str, alignment: SensorToSegment) -> float:
    """Largest standard deviation [rad] about an axis that motion can reduce."""
    shown = 2 if _part(segment)[1] in TURN_UNSEEN else 3
    return float(np.max(alignment.stddev[:shown]))


def what_is_missing(
    alignments: Mapping[str, SensorToSegment],
    alike: Sequence[tuple[str, str]],
    enough: float,
) -> tuple[str, float]:
    """The most useful next movement, and the progress.

    Args:
        alignments: The alignments so far.
        alike: Pairs of segments with similar motions so far.
        enough: Standard deviation [rad] that suffices.

    Returns:
        A sentence, empty if nothing is missing; and the progress, 0 to 1.
    """
    stddev = {segment: wanted_stddev(segment, each) for segment, each in alignments.items()}
    shares = {segment: min(1.0, enough / each) for segment, each in stddev.items()}
    progress = float(np.mean([*shares.values(), *(0.0 for _ in alike[:1])])) if shares else 0.0
    worst = min(shares, key=lambda segment: shares[segment], default=None)
    if worst is not None and shares[worst] < 1.0:
        known = f"{worst} is known to {np.degrees(stddev[worst]):.1f} deg"
        return f"{how_to_move(worst)} ({known})", progress
    if alike:
        first, second = alike[0]
        return f"{how_to_move(first)} ({first} and {second} have moved alike)", progress
    return "", 1.0


def how_to_move(segment: str) -> str:
    """Instruction for a movement that excites a segment's sensor."""
    side, part = _part(segment)
    return MOVES[part].format(side=f"{side} " if side else "")


def _part(segment: str) -> tuple[str, str]:
    side, _, part = segment.partition("_")
    return (side, part) if side in ("left", "right") else ("", segment)
