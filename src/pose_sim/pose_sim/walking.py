"""Walking before the sensors, as in a calibration.

The feet carry the body and do not slide, so the legs' angles determine its path.
Angles are degrees in the conventions of ``docs/conventions.md``.
"""

from pose_core.joints import SIDES, other_side
from pose_sim.moves import both, quarter_turn, turn_steps
from pose_sim.timeline import AngleTimeline

FORWARD = (17.0, -13.0)  # [deg] hip flexion of the swing leg and of the stance leg: steps of 0.45 m
BACKWARD = (-13.0, 14.0)


def walk_about(t: AngleTimeline) -> None:
    """Walk from side to side and from near to far, turn to both sides, raise the arms."""
    t.lean = 0.0
    quarter_turn(t, "left", 1.0)
    walk(t, steps=2)
    raise_arms(t, shoulder_flexion=80, elbow_flexion=20)
    turn_steps(t, "right", -1.0, steps=6, size=30.0, arms=10)
    walk(t, steps=4)
    raise_arms(t, shoulder_abduction=75)
    turn_steps(t, "left", 1.0, steps=6, size=30.0, arms=10)
    walk(t, steps=2)
    quarter_turn(t, "right", -1.0)
    walk(t, steps=2, hips=BACKWARD)
    raise_arms(t, shoulder_flexion=40, shoulder_abduction=50)
    walk(t, steps=2)


def walk(t: AngleTimeline, *, steps: int, hips: tuple[float, float] = FORWARD) -> None:
    """Take some steps, beginning with the left foot, and bring the feet together."""
    for number in range(steps):
        _step(t, SIDES[number % 2], hips, knee=38.0, arms=10.0)
    _step(t, SIDES[steps % 2], (0.0, 0.0), knee=28.0, arms=0.0)


def raise_arms(t: AngleTimeline, **angles: float) -> None:
    """Raise both arms and lower them."""
    t.move(1.0, both(**angles))
    t.move(0.9, both(**dict.fromkeys(angles, 0.0)))


def _step(
    t: AngleTimeline, side: str, hips: tuple[float, float], *, knee: float, arms: float
) -> None:
    stance = other_side(side)
    swings = {f"{side}_hip_flexion": hips[0], f"{stance}_hip_flexion": hips[1]}
    swings |= {f"{side}_shoulder_flexion": -0.5 * arms, f"{stance}_shoulder_flexion": arms}
    t.move(0.62, swings, exact=True, advance=0.0)
    t.move(0.3, {f"{side}_knee_flexion": knee})
    t.move(0.32, {f"{side}_knee_flexion": 0.0}, exact=True)
