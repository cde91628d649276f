"""The suite on captured motion: persons, trackers and conditions of its sessions.

Conditions alternate from session to session, so that each has a third:

    condition = CONDITIONS[index of the session mod 3]                                       (1)
"""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pose_core.errors import InputError
from pose_sim.captured.clips import bundled_clips, clips_in
from pose_sim.captured.session import CapturedSpec
from pose_sim.captured.trackers import HELD_OUT_TRACKERS, TUNING_TRACKERS

KNOWN, CALIBRATED, OFFSET = "known", "calibrated", "offset"
CONDITIONS = (KNOWN, CALIBRATED, OFFSET)
"""``known``: the true extrinsics; ``calibrated``: estimated from the session's samples; ``offset``:
the same, and the right camera's clock is off by one of :data:`CLOCK_OFFSETS_S`."""
CLOCK_OFFSETS_S = (-0.12, 0.08, 0.2)  # [s] offsets of the right camera's clock
TUNING_SOURCES = ("clips", "cmu")
"""Folders of motion that tuning used: the bundled clips and the rest of CMU's."""
DELAYS_S = (0.0, 0.03, 0.06, 0.08)  # [s] delays of held-out trackers
GROUPED = 16  # approximate number of clips in a session


def captured_specs(
    motion: Path | None, *, held_out: bool, seed: int, first: int = 0
) -> list[CapturedSpec]:
    """Sessions from a folder of clips, grouped by person by its ``index.csv``.

    Args:
        motion: The folder; None: the clips bundled with ``pose_sim``.
        held_out: Whether to use the held-out trackers, with ``mixed``, and delays.
        seed: Random seed.
        first: Index of the first session, if there are earlier ones.

    Raises:
        InputError: If the folder holds no clips.
    """
    clips = bundled_clips() if motion is None else clips_in(motion)
    if not clips:
        raise InputError(f"{motion} holds no clips: expected .npz or .bvh files, see pose_sim")
    trackers = (*HELD_OUT_TRACKERS, "mixed") if held_out else TUNING_TRACKERS
    rng = np.random.default_rng(seed)
    specs: list[CapturedSpec] = []
    for name, files in _groups(motion, clips):
        order = rng.permutation(len(files))
        delays = rng.choice(DELAYS_S, 2) if held_out else None
        clock_offset = float(rng.choice(CLOCK_OFFSETS_S))
        index = first + len(specs)
        condition = CONDITIONS[index % len(CONDITIONS)]  # (1)
        pair = trackers[index % len(trackers)], trackers[(3 * index + 1) % len(trackers)]
        specs.append(
            CapturedSpec(
                name=name,
                clips=tuple(files[i] for i in order),
                trackers=pair,
                spins=index % 2 == 1,
                seed=seed + index,
                condition=condition,
                delays_s=None if delays is None else (float(delays[0]), float(delays[1])),
                clock_offset_s=clock_offset if condition == OFFSET else 0.0,
            )
        )
    return specs


def caption(specs: Sequence[CapturedSpec]) -> str:
    """Caption of the sessions' table; it says whether tuning used their motion."""
    used = sorted({spec.clips[0].parent.name for spec in specs} & set(TUNING_SOURCES))
    remark = f"; tuning used the motion of {', '.join(used)}" if used else ""
    return f"Captured people, {len(specs)} sessions{remark}"


def _groups(motion: Path | None, clips: Sequence[Path]) -> list[tuple[str, list[Path]]]:
    """Groups of clips of one person, by the index, in parts of a session's duration."""
    person: dict[str, str] = {}
    if motion is not None and (motion / "index.csv").exists():
        with (motion / "index.csv").open() as file:
            person = {row["file"]: row["subject"] for row in csv.DictReader(file)}
    groups: dict[str, list[Path]] = {}
    for clip in clips:
        groups.setdefault(person.get(clip.name, "clips"), []).append(clip)
    parts = []
    for name, files in sorted(groups.items()):
        count = max(1, round(len(files) / GROUPED)) if len(files) > 3 else 1
        parts += [(f"{name} {k + 1}", files[k::count]) for k in range(count)]
    return parts
