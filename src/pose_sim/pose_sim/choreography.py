"""Choreographies of the synthetic subject, by name.

To add one, write a function that adds one round of it to a :class:`pose_sim.timeline.AngleTimeline`
with the moves of :mod:`pose_sim.moves`, and one line in :data:`CHOREOGRAPHIES`. Angles are degrees
in the conventions of ``docs/conventions.md``. Rounds are repeated until the duration is filled.
"""

from collections.abc import Callable

import numpy as np

from pose_core.errors import InputError
from pose_core.joints import SIDE_SIGNS, SIDES, other_side
from pose_sim.body import Body
from pose_sim.jump import jump
from pose_sim.motion import Motion, perform
from pose_sim.moves import both, lift_knee, march, quarter_turn, shift_weight, side_leg_lifts, sink
from pose_sim.timeline import AngleTimeline, Variation
from pose_sim.walking import walk_about
from pose_sim.whole_body import crouch_behind_arm, dance, kicks, reach, twisting, walk_turns

STILL = 2.5  # [s] neutral pose at the start of every session
SHORTEST = 5.0  # [s]
LONGEST = 3600.0  # [s]

Choreography = Callable[[AngleTimeline], None]


def compose(
    name: str,
    duration: float,
    seed: int,
    *,
    height: float = 1.75,
    variation: Variation | None = None,
    place: tuple[float, float] = (0.0, 0.0),
    heading: float = 0.0,
) -> Motion:
    """A session: standing still, a warm-up, then rounds of the choreography.

    Args:
        name: One of :data:`CHOREOGRAPHIES`.
        duration: Duration [s]; the motion is cut off at its end.
        seed: Source of all natural variation; the same seed gives the same motion.
        height: Body height [m].
        variation: Amount of natural variation.
        place: Initial position, x and y [m] in ``map``.
        heading: Initial heading [rad], about ``map``'s z from its x.

    Raises:
        InputError: If there is no such choreography, or the duration is too short or too long.
    """
    if name not in CHOREOGRAPHIES:
        raise InputError(f"unknown choreography '{name}': expected {', '.join(CHOREOGRAPHIES)}")
    if duration > LONGEST:
        raise InputError(
            f"duration = {duration:g} s is too long: a session may last {LONGEST:g} s, "
            "all of it is made in memory"
        )
    if not duration >= SHORTEST:
        raise InputError(
            f"duration = {duration:g} s is too short: a session needs {SHORTEST:g} s or more, "
            f"{STILL:g} s of it standing still"
        )
    plan_rng, sway_rng = np.random.default_rng([seed, 1]).spawn(2)
    timeline = AngleTimeline(Body(height), plan_rng, variation)
    plan(CHOREOGRAPHIES[name], duration, timeline)
    return perform(timeline, duration, place=place, heading=heading, rng=sway_rng, still=STILL)


def plan(choreography: Choreography, duration: float, timeline: AngleTimeline) -> None:
    """Fill a timeline to ``duration`` [s]: standing still, warm-up, rounds of a choreography."""
    timeline.now = STILL
    warm_up(timeline)
    while timeline.now < duration:
        choreography(timeline)


def warm_up(t: AngleTimeline) -> None:
    """Move arms, legs and trunk once through the motions that a calibration needs."""
    t.move(1.1, both(shoulder_flexion=85, elbow_flexion=25), advance=0.7)
    t.move(0.9, both(shoulder_abduction=45, elbow_flexion=70))
    for side_sign, advance in ((1.0, 0.8), (-1.0, 1.0), (0.0, 0.2)):
        twist = {"thoracic_rotation": 22.0, "lumbar_rotation": 8.0, "neck_rotation": 15.0}
        t.move(1.0, {name: side_sign * value for name, value in twist.items()}, advance=advance)
    t.move(1.0, both(shoulder_flexion=0, shoulder_abduction=0, elbow_flexion=0))
    for side in SIDES:
        shift_weight(t, away_from=side, duration=0.5)
        lift_knee(t, side, 1.5, hip=55, knee=82)
        shift_weight(t, away_from="", duration=0.4)
    lean = {"pelvis_tilt": 12.0, "lumbar_flexion": 12.0, "thoracic_flexion": 15.0}
    lean |= {"neck_flexion": 8.0, **both(hip_flexion=12, shoulder_abduction=30)}
    t.move(1.0, lean, exact=True)
    t.move(1.0, dict.fromkeys(lean, 0.0), exact=True)


def leg_lift_march(t: AngleTimeline) -> None:
    """Side leg lift, then marching on the spot (li2020's motion B)."""
    side_leg_lifts(t)
    march(t, steps=14)
    t.wait(0.4)


def leg_lift_jump(t: AngleTimeline) -> None:
    """Side leg lift, then jumps (li2020's motion A, without the box)."""
    side_leg_lifts(t)
    for _ in range(3):
        jump(t)
        t.wait(0.5)


def squats(t: AngleTimeline) -> None:
    """Two deep squats, arms forward for balance."""
    for _ in range(2):
        t.move(0.5, both(shoulder_flexion=70), advance=0.1)
        sink(t, 1.3, knee=float(98.0 + 8.0 * np.tanh(t.vary())))
        t.wait(0.2)
        t.move(1.1, both(shoulder_flexion=0), advance=0.05)
        sink(t, 1.1, knee=0.0)
        t.wait(0.3)


def arm_raises(t: AngleTimeline) -> None:
    """Arms to overhead in front and in the plane of the shoulder blades, and level to the sides."""
    t.move(1.3, both(shoulder_flexion=165, elbow_flexion=8))
    t.move(1.2, both(shoulder_flexion=0, elbow_flexion=0))
    t.wait(0.3)
    t.move(1.1, both(shoulder_abduction=84, shoulder_flexion=8, elbow_flexion=6))
    t.wait(0.3)
    t.move(1.1, both(shoulder_abduction=0, shoulder_flexion=0, elbow_flexion=0))
    t.wait(0.2)
    # Outwards on the way up and back in at the top: avoids the singularity at 90 deg abduction.
    for overhead, inwards in ((168, 8), (0, 0)):
        t.move(1.6, both(shoulder_flexion=overhead), advance=0.0)
        t.move(0.8, both(shoulder_abduction=52))
        t.move(0.8, both(shoulder_abduction=inwards))
        t.wait(0.25)


def bow(t: AngleTimeline) -> None:
    """Bow from the hips and along the whole spine, then bend to both sides."""
    forward = {"pelvis_tilt": 32.0, "lumbar_flexion": 26.0, "thoracic_flexion": 20.0}
    forward |= {"neck_flexion": 12.0, **both(hip_flexion=27)}
    t.move(1.5, forward, exact=True, advance=0.0)
    t.move(1.5, both(shoulder_flexion=50))
    t.wait(0.6)
    t.move(1.4, dict.fromkeys(forward, 0.0), exact=True, advance=0.0)
    t.move(1.4, both(shoulder_flexion=0))
    t.wait(0.5)
    for degrees in (14.0, 0.0, -14.0, 0.0):
        shares = {"lumbar_lateral_bending": 0.7, "thoracic_lateral_bending": 1.0}
        t.move(1.0, {name: share * degrees for name, share in shares.items()})


def turn(t: AngleTimeline) -> None:
    """Turn by 90 deg to the left, look around and reach, turn back, then to the other side."""
    for first, sign in SIDE_SIGNS.items():
        for direction, lead in ((sign, first), (-sign, other_side(first))):
            quarter_turn(t, lead, direction)
            t.move(0.8, both(shoulder_flexion=60, elbow_flexion=40))
            t.move(0.8, both(shoulder_flexion=0, elbow_flexion=0))
            t.wait(0.3)


CHOREOGRAPHIES: dict[str, Choreography] = {
    choreography.__name__: choreography
    for choreography in (
        *(leg_lift_march, leg_lift_jump, squats, arm_raises, bow, turn),
        *(twisting, dance, kicks, walk_turns, crouch_behind_arm, reach, walk_about),
    )
}
