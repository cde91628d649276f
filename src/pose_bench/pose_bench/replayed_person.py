"""The captured person whose session the benches of faults, load and soak replay."""

import numpy as np

from pose_sim.captured.clips import bundled_clips
from pose_sim.captured.session import CapturedSession, CapturedSpec, make_captured_session

SESSION_S = 62.0  # [s] of captured motion


def captured_person() -> CapturedSession:
    """The session, always the same."""
    clips = bundled_clips()
    order = np.random.default_rng(5).permutation(len(clips))
    spec = CapturedSpec(
        name="faults",
        clips=tuple(clips[i] for i in order),
        trackers=("mixed", "calm"),
        spins=False,
        seed=5,
        duration_s=SESSION_S,
    )
    return make_captured_session(spec)
