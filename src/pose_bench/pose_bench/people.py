"""How well several people keep their identities, and what that costs."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pose_core.api import PeopleTracker
from pose_evaluation.identity import IdentityScore, score_identities
from pose_sim.captured.clips import bundled_clips
from pose_sim.captured.crowd import Crowd, CrowdSpec, make_crowd


@dataclass(frozen=True, kw_only=True)
class PeopleScore:
    """Of one scene."""

    identity: IdentityScore
    frame_s: float  # [s] of computing time, mean over the sensors' frames


def make_scene(people: int, seed: int, duration_s: float, *, leaves: bool = True) -> Crowd:
    """People drawn from the bundled clips before two cameras; the same seed, the same scene."""
    clips = bundled_clips()
    drawn = np.random.default_rng(seed).permutation(len(clips))[:people]
    chosen = tuple(clips[i] for i in drawn)
    return make_crowd(CrowdSpec(clips=chosen, seed=seed, duration_s=duration_s, leaves=leaves))


def score_scene(scene: Crowd) -> PeopleScore:
    """Assign a scene's skeletons to people, and compare with who they are."""
    tracker = PeopleTracker(scene.T_map_sensor)
    given: dict[int, int] = {}
    begin_s = time.process_time()
    for frame in scene.frames:
        for number, sample in tracker.add(frame.persons):
            given[id(sample)] = number
    spent_s = time.process_time() - begin_s
    pairs = [
        (who, given.get(id(sample)))
        for frame in scene.frames
        for sample, who in zip(frame.persons, frame.truth, strict=True)
    ]
    return PeopleScore(
        identity=score_identities(pairs), frame_s=spent_s / max(len(scene.frames), 1)
    )


def score_scenes(
    people: int, seeds: Sequence[int], duration_s: float, *, leaves: bool
) -> PeopleScore:
    """The sum over several scenes."""
    scores = [score_scene(make_scene(people, seed, duration_s, leaves=leaves)) for seed in seeds]
    total = scores[0].identity
    for score in scores[1:]:
        total = total + score.identity
    return PeopleScore(identity=total, frame_s=float(np.mean([s.frame_s for s in scores])))
