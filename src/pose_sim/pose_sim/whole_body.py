"""Choreographies of the whole body: twists, dance, kicks, turns, hidden joints, reaching.

Each adds one round to a :class:`pose_sim.timeline.AngleTimeline`. Angles are degrees in the
conventions of ``docs/conventions.md``; speeds are moderate, except for the kicks.
"""

from collections.abc import Mapping

from pose_core.joints import SIDE_SIGNS, SIDES, other_side
from pose_sim.moves import bend_forward, both, march, shift_weight, sink, turn_pelvis, turn_steps
from pose_sim.timeline import AngleTimeline

ARMS = ("shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion")
GIRDLE = ("clavicle_elevation", "clavicle_protraction")


def twisting(t: AngleTimeline) -> None:
    """Twist the spine to both sides, arms out; then quicker, arms bent."""
    yaw = t.target("pelvis_yaw")
    t.move(1.0, both(shoulder_abduction=66, elbow_flexion=6))
    for degrees in (42.0, -42.0, 50.0, -50.0, 0.0):
        twist(t, 1.2, yaw, degrees)
    t.move(0.8, both(shoulder_abduction=25, shoulder_flexion=45, elbow_flexion=95))
    for degrees in (36.0, -36.0, 36.0, -36.0, 0.0):
        twist(t, 0.75, yaw, degrees)
    rest_arms(t, 0.9)
    t.wait(0.3)


def dance(t: AngleTimeline) -> None:
    """Steps with arms overhead, a turn by 60 deg, bends and twists, and the turn back."""
    yaw = t.target("pelvis_yaw")
    for lead, sign in SIDE_SIGNS.items():
        t.move(0.9, both(shoulder_flexion=145, shoulder_abduction=15, elbow_flexion=25))
        for beat in range(4):
            step_touch(t, SIDES[beat % 2])
        t.move(0.8, both(shoulder_flexion=15, shoulder_abduction=55, elbow_flexion=30))
        turn_steps(t, lead, sign, steps=4, size=15.0)
        dip(t, other_side(lead))
        t.move(0.6, both(shoulder_flexion=30, shoulder_abduction=40, elbow_flexion=70))
        for degrees in (30.0, -30.0, 0.0):
            twist(t, 0.7, yaw + 60.0 * sign, degrees)
        turn_steps(t, other_side(lead), -sign, steps=4, size=15.0)
        rest_arms(t, 0.8)


def kicks(t: AngleTimeline) -> None:
    """A front kick and a side kick with each leg, arms held up."""
    t.move(0.7, both(shoulder_flexion=30, shoulder_abduction=18, elbow_flexion=80))
    for side in SIDES:
        front_kick(t, side)
        t.wait(0.2)
        side_kick(t, side)
        t.wait(0.3)
    rest_arms(t, 0.7)


def walk_turns(t: AngleTimeline) -> None:
    """Walk on the spot, turn right round, walk on, turn back by a quarter, to either side."""
    for lead, sign in SIDE_SIGNS.items():
        march(t, steps=4)
        turn_steps(t, lead, sign, steps=12, size=30.0, arms=12)
        march(t, steps=4)
        turn_steps(t, other_side(lead), -sign, steps=6, size=15.0, arms=12)
        t.move(0.5, both(shoulder_flexion=0))


def crouch_behind_arm(t: AngleTimeline) -> None:
    """Crouch with a forearm before the face, then with both arms before the body."""
    for side in SIDES:
        shield = {"shoulder_flexion": 82.0, "shoulder_rotation": 65.0, "elbow_flexion": 100.0}
        t.move(0.9, {f"{side}_{name}": degrees for name, degrees in shield.items()})
        sink(t, 1.2, knee=78.0)
        t.wait(0.4)
        t.move(0.7, {"thoracic_rotation": 14.0 * SIDE_SIGNS[side], "neck_rotation": 10.0})
        t.move(0.7, {"thoracic_rotation": 0.0, "neck_rotation": 0.0})
        crossed = both(shoulder_flexion=42, shoulder_rotation=50, elbow_flexion=80)
        t.move(0.9, crossed)
        t.wait(0.4)
        sink(t, 1.1, knee=0.0)
        rest_arms(t, 0.9)


def reach(t: AngleTimeline) -> None:
    """Reach up high, far forward and across with each arm, then draw both elbows back."""
    for side in SIDES:
        sign = SIDE_SIGNS[side]
        up = arm(side, flexion=158, abduction=8, elbow=4, elevation=12)
        reach_once(t, up, {"thoracic_lateral_bending": 8.0 * sign, "thoracic_flexion": -5.0})
        forward = arm(side, flexion=92, elbow=3, protraction=15)
        turned = {"thoracic_rotation": -20.0 * sign, "neck_rotation": 12.0 * sign}
        reach_once(t, forward, turned, lean=22.0)
        across = arm(side, flexion=72, abduction=-26, elbow=12, protraction=13)
        reach_once(t, across, {"thoracic_rotation": -16.0 * sign, "lumbar_rotation": -6.0 * sign})
    backward = both(shoulder_flexion=-32, elbow_flexion=85, clavicle_protraction=-12)
    t.move(0.9, backward)
    t.wait(0.2)
    t.move(0.9, dict.fromkeys(backward, 0.0))


def arm(
    side: str,
    *,
    flexion: float,
    elbow: float,
    abduction: float = 0.0,
    elevation: float = 0.0,
    protraction: float = 0.0,
) -> dict[str, float]:
    """Angles [deg] of one arm and its clavicle, in addition to the clavicle's coupled motion."""
    return {
        f"{side}_shoulder_flexion": flexion,
        f"{side}_shoulder_abduction": abduction,
        f"{side}_elbow_flexion": elbow,
        f"{side}_clavicle_elevation": elevation,
        f"{side}_clavicle_protraction": protraction,
    }


def reach_once(
    t: AngleTimeline, pose: Mapping[str, float], trunk: Mapping[str, float], lean: float = 0.0
) -> None:
    """Reach and return, with the trunk leaning forward by ``lean`` [deg]."""
    bend_forward(t, 1.0, lean)
    t.move(1.0, {**pose, **trunk})
    t.wait(0.25)
    bend_forward(t, 0.9, 0.0)
    t.move(0.9, dict.fromkeys((*pose, *trunk), 0.0))


def rest_arms(t: AngleTimeline, duration: float) -> None:
    """Lower both arms and shoulder girdles to the neutral pose."""
    t.move(duration, both(**dict.fromkeys((*ARMS, *GIRDLE), 0.0)))


def twist(t: AngleTimeline, duration: float, yaw: float, degrees: float) -> None:
    """Twist by ``degrees`` at the shoulders over feet at ``yaw``; the head turns further."""
    turn_pelvis(t, duration, yaw, 0.2 * degrees)
    shares = {"lumbar_rotation": 0.2, "thoracic_rotation": 0.6, "neck_rotation": 0.25}
    t.move(duration, {name: share * degrees for name, share in shares.items()})


def step_touch(t: AngleTimeline, side: str) -> None:
    """A leg to the side and back, both arms overhead in the opposite direction, then the trunk."""
    sign = SIDE_SIGNS[side]
    wave = {
        f"{side}_shoulder_flexion": 158.0,
        f"{side}_shoulder_abduction": 30.0,
        f"{other_side(side)}_shoulder_flexion": 128.0,
        f"{other_side(side)}_shoulder_abduction": -12.0,
        **both(elbow_flexion=35),
    }
    lean = {"lumbar_lateral_bending": 5.0 * sign, "thoracic_lateral_bending": 10.0 * sign}
    shift_weight(t, away_from=side, duration=0.35)
    begun = t.now
    t.move(0.8, {**wave, **lean, "thoracic_rotation": 12.0 * sign}, advance=0.0)
    stance = t.target(f"{side}_hip_abduction")
    t.move(0.4, {f"{side}_hip_abduction": 22.0, f"{side}_knee_flexion": 28.0}, advance=0.0)
    t.move(0.4, {f"{side}_hip_flexion": 16.0})
    down = {f"{side}_knee_flexion": 0.0, f"{side}_hip_flexion": 0.0}
    t.move(0.4, {**down, f"{side}_hip_abduction": stance}, exact=True)
    t.now = max(t.now, begun + 0.8)
    shift_weight(t, away_from="", duration=0.3)


def dip(t: AngleTimeline, side: str) -> None:
    """Bend deep to the front, arms hanging through, come up bent to a side."""
    sign = SIDE_SIGNS[side]
    bend_forward(t, 1.0, 62.0)
    t.move(1.0, both(shoulder_flexion=48, shoulder_abduction=10, elbow_flexion=10))
    bend_forward(t, 1.0, 0.0)
    up = {f"{side}_shoulder_flexion": 150.0, f"{side}_shoulder_abduction": 12.0}
    bent = {"thoracic_lateral_bending": 14.0 * sign, "lumbar_lateral_bending": 6.0 * sign}
    t.move(1.0, {**up, **bent})
    t.move(0.8, {**dict.fromkeys(bent, 0.0), **both(shoulder_flexion=20)})


def front_kick(t: AngleTimeline, side: str) -> None:
    """Knee up, kick to the front leaning back, and down."""
    kick = f"{side}_hip_flexion", f"{side}_knee_flexion"
    back = {"pelvis_tilt": -8.0, f"{other_side(side)}_hip_flexion": -8.0, "lumbar_flexion": -5.0}
    shift_weight(t, away_from=side, duration=0.4)
    t.move(0.4, dict(zip(kick, (72.0, 88.0), strict=True)))
    t.move(0.3, back, exact=True, advance=0.0)
    t.move(0.3, dict(zip(kick, (84.0, 12.0), strict=True)))
    t.wait(0.06)
    t.move(0.32, dict(zip(kick, (70.0, 88.0), strict=True)))
    t.move(0.5, dict.fromkeys(back, 0.0), exact=True, advance=0.0)
    t.move(0.5, dict.fromkeys(kick, 0.0), exact=True)
    shift_weight(t, away_from="", duration=0.4)


def side_kick(t: AngleTimeline, side: str) -> None:
    """Knee up, kick to the side leaning away from it, and down."""
    sign, stance = SIDE_SIGNS[side], f"{other_side(side)}_hip_abduction"
    kick = f"{side}_hip_flexion", f"{side}_knee_flexion", f"{side}_hip_abduction"
    shift_weight(t, away_from=side, duration=0.4)
    upright = {stance: t.target(stance), "pelvis_obliquity": 0.0}
    down = (0.0, 0.0, t.target(kick[2]))
    # The pelvis tips by 10 deg towards the standing leg, which stays as it is.
    away = {stance: upright[stance] + 10.0, "pelvis_obliquity": 10.0 * sign}
    trunk = {"lumbar_lateral_bending": 6.0 * sign, "thoracic_lateral_bending": 8.0 * sign}
    t.move(0.45, dict(zip(kick, (58.0, 92.0, 16.0), strict=True)))
    t.move(0.36, away, exact=True, advance=0.0)
    t.move(0.36, {**dict(zip(kick, (22.0, 10.0, 54.0), strict=True)), **trunk})
    t.wait(0.08)
    t.move(0.38, dict(zip(kick, (55.0, 90.0, 16.0), strict=True)))
    t.move(0.55, {**upright, **dict.fromkeys(trunk, 0.0)}, exact=True, advance=0.0)
    t.move(0.55, dict(zip(kick, down, strict=True)), exact=True)
    shift_weight(t, away_from="", duration=0.4)
