"""Elementary moves of choreographies, on a :class:`pose_sim.timeline.AngleTimeline`.

Angles are degrees in the conventions of ``docs/conventions.md``.
"""

from typing import TypeVar

from pose_core.joints import SIDE_SIGNS, SIDES, other_side
from pose_sim.timeline import AngleTimeline

T = TypeVar("T")


def both(**angles: T) -> dict[str, T]:
    """The same angles for the left and the right."""
    return {f"{side}_{name}": value for side in SIDES for name, value in angles.items()}


def shift_weight(t: AngleTimeline, away_from: str, duration: float) -> None:
    """Move the pelvis sideways over one foot: both legs lean equally, both feet stay."""
    lean = {"left": 4.5, "right": -4.5, "": 0.0}[away_from]
    legs = {"left_hip_abduction": lean, "right_hip_abduction": -lean}
    t.move(duration, {**legs, "lumbar_lateral_bending": -0.5 * lean}, exact=True)


def lift_knee(
    t: AngleTimeline, side: str, duration: float, *, hip: float, knee: float, arms: float = 0.0
) -> None:
    """Lift a knee and put the foot down again."""
    arm = f"{other_side(side)}_shoulder_flexion", f"{side}_shoulder_flexion"
    if arms:
        t.move(0.5 * duration, {arm[0]: arms, arm[1]: -0.5 * arms}, advance=0.0)
    lifted = {f"{side}_hip_flexion": hip, f"{side}_knee_flexion": knee}
    t.move(0.5 * duration, {**lifted, f"{side}_ankle_flexion": -15.0})
    t.move(0.5 * duration, {**dict.fromkeys(lifted, 0.0), f"{side}_ankle_flexion": 0.0})


def side_leg_lifts(t: AngleTimeline) -> None:
    """Lift each straight leg sideways once."""
    for side, sign in SIDE_SIGNS.items():
        shift_weight(t, away_from=side, duration=0.6)
        arms = both(shoulder_abduction=18)
        trunk = {"lumbar_lateral_bending": 3.0 * sign, "pelvis_obliquity": -2.0 * sign}
        lean = t.target(f"{side}_hip_abduction")
        t.move(1.1, {**trunk, **arms, f"{side}_hip_flexion": 4.0}, advance=0.0)
        t.move(1.1, {f"{side}_hip_abduction": 38.0})
        t.wait(0.35)
        still = dict.fromkeys((*trunk, *arms), 0.0)
        t.move(1.0, {**still, f"{side}_hip_flexion": 0.0}, exact=True, advance=0.0)
        t.move(1.0, {f"{side}_hip_abduction": lean}, exact=True)
        shift_weight(t, away_from="", duration=0.5)
        t.wait(0.2)


def march(t: AngleTimeline, steps: int) -> None:
    """March on the spot, arms swinging against the legs."""
    t.move(0.5, both(elbow_flexion=55), advance=0.1)
    for step in range(steps):
        side = SIDES[step % 2]
        start = t.now
        shift_weight(t, away_from=side, duration=0.45)
        t.now = start + 0.12
        lift_knee(t, side, 0.66, hip=60, knee=92, arms=24)
    shift_weight(t, away_from="", duration=0.4)
    t.move(0.7, both(elbow_flexion=0, shoulder_flexion=0))


def sink(t: AngleTimeline, duration: float, knee: float) -> None:
    """Bend both knees by ``knee`` [deg] with the weight over the feet; zero stands up.

    Shanks lean forward, thighs back, the trunk forward.
    """
    squat = {
        "pelvis_tilt": 0.33 * knee,
        "thoracic_flexion": 0.06 * knee,
        "neck_flexion": -0.2 * knee,
        **both(hip_flexion=0.95 * knee, knee_flexion=knee, hip_abduction=0.05 * knee),
    }
    t.move(duration, squat, exact=True)


def quarter_turn(t: AngleTimeline, lead: str, sign: float) -> None:
    """Turn by 90 deg in six small steps; ``sign`` is +1 to the left."""
    turn_steps(t, lead, sign, steps=6, size=15.0, arms=8)
    t.move(0.4, both(shoulder_flexion=0))


def turn_steps(
    t: AngleTimeline, lead: str, sign: float, *, steps: int, size: float, arms: float = 0.0
) -> None:
    """Turn by ``size`` [deg] a step, an even number of steps; ``sign`` is +1 to the left."""
    for step in range(steps):
        side = lead if step % 2 == 0 else other_side(lead)
        # The lifted foot turns by twice the size, the pelvis by once; the other foot stays.
        rotation = -size if step % 2 == 0 else 0.0
        turned = {"pelvis_yaw": t.target("pelvis_yaw") + sign * size}
        t.move(0.5, {**turned, **both(hip_rotation=rotation)}, exact=True, advance=0.0)
        lift_knee(t, side, 0.5, hip=24, knee=46, arms=arms)


def turn_pelvis(t: AngleTimeline, duration: float, yaw: float, degrees: float) -> None:
    """Turn the pelvis to ``yaw`` + ``degrees`` over feet that stay at ``yaw`` [deg].

    The timeline's time is not advanced.
    """
    feet = {"left_hip_rotation": degrees, "right_hip_rotation": -degrees}
    t.move(duration, {"pelvis_yaw": yaw + degrees, **feet}, exact=True, advance=0.0)


def bend_forward(t: AngleTimeline, duration: float, degrees: float) -> None:
    """Bend forward from the hips and along the spine by ``degrees`` at the neck, legs upright.

    The timeline's time is not advanced.
    """
    bent = {"pelvis_tilt": 0.4, "lumbar_flexion": 0.3, "thoracic_flexion": 0.3}
    bent |= both(hip_flexion=0.4)
    targets = {name: share * degrees for name, share in bent.items()}
    t.move(duration, targets, exact=True, advance=0.0)
