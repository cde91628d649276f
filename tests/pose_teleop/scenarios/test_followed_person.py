"""A simulated robot follows a person, with faults of all kinds."""

import numpy as np
import pytest
from followed_person import START_NS, Followed, person_urdf

from pose_teleop.supervisor import State, StopReason

pytest.importorskip("ruckig")
pytest.importorskip("pinocchio")
SLACK = 1e-9
START = [State.WAITING, State.SOFT_START, State.FOLLOWING]
STOP = [State.SLOWING, State.FROZEN]


def followed(**parameters):
    story = Followed(**parameters)
    assert story.go(2.0) == START
    return story


def check_limits(story):
    assert max(story.excess()) < SLACK
    assert story.jerk_excess() < SLACK
    robot = story.controller.robot
    moved = np.array(story.run.robot)
    assert (moved > robot.lower).all()
    assert (moved < robot.upper).all()
    speed = np.abs(np.diff(moved, axis=0)) / 0.01
    assert (speed < robot.max_velocity).all()


def fault_of(story):
    return story.controller.supervisor.fault


def test_the_robot_follows_joint_by_joint():
    story = followed()
    begin = len(story.run.state)
    story.go(3.0)

    error = np.array(story.run.robot)[begin:] - np.array(story.run.target)[begin:]
    assert np.degrees(np.sqrt((error**2).mean())) < 2.5  # it hears a trajectory a period ahead
    check_limits(story)


@pytest.mark.parametrize("mirror", [False, True])
@pytest.mark.parametrize("side", ["left", "right"])
def test_the_wrist_is_where_the_persons_is_scaled_to_the_robots_arm(side, mirror):
    story = followed(mode="wrist", side=side, mirror=mirror)
    story.go(0.5)

    mapping, arm = story.controller._mapping, story.controller.robot
    goal = mapping.goal(story.controller.monitor.angles)
    arm.update(story.run.robot[-1])
    place, _ = arm.place(arm.file.tool)
    assert np.linalg.norm(place - goal.tool) < 0.05
    check_limits(story)


def test_mirrored_the_other_arm_does_the_same():
    left, mirrored = followed(mode="wrist"), followed(mode="wrist", side="right", mirror=True)

    tool = [
        s.controller._mapping.goal(np.array([0.5, 0.4, 0.2, 1.0])).tool for s in (left, mirrored)
    ]
    np.testing.assert_allclose(tool[0], tool[1], atol=1e-9)


def test_a_robot_unlike_an_arm_reaches_for_the_wrists_place():
    story, angles = Followed(mode="wrist", robot="panda"), np.full(4, 0.5)
    mapping, arm = story.controller._mapping, story.controller.robot

    arm.update(mapping.target(angles))

    place, _ = arm.place(arm.file.tool)
    assert np.linalg.norm(place - mapping.goal(angles).tool) < 0.08


TROUBLES = {
    "streams end": (StopReason.STALE, lambda s: s.go(1.0, heard=False)),
    "the robot is silent": (StopReason.NO_ROBOT, lambda s: s.go(1.0, robot_heard=False)),
    "the input is let go": (
        StopReason.NOT_HELD,
        lambda s: (setattr(s, "held", False), s.go(1.0))[1],
    ),
    "deviations grow": (StopReason.UNCERTAIN, lambda s: (setattr(s, "stddev", 0.8), s.go(1.0))[1]),
    "angles are no numbers": (
        StopReason.NOT_FINITE,
        lambda s: s.go(1.0, hear=lambda: s.hear(angles=np.full(4, np.nan), rates=np.zeros(4))),
    ),
    "old stamps": (
        StopReason.STALE,
        lambda s: s.go(1.0, hear=lambda: s.hear(stamp_ns=s.now().ros_ns - 10**9)),
    ),
    "stamps ahead": (
        StopReason.CLOCK,
        lambda s: s.go(1.0, hear=lambda: s.hear(stamp_ns=s.now().ros_ns + 10**9)),
    ),
    "the person changes": (
        StopReason.PERSON_CHANGED,
        lambda s: (setattr(s, "person", "other"), s.go(1.0))[1],
    ),
}


@pytest.mark.parametrize("name", TROUBLES)
def test_the_robot_stops_within_its_limits_when(name):
    story = followed()
    fault, happen = TROUBLES[name]

    states = happen(story)

    assert states[:2] in (STOP, [State.FOLLOWING, State.SLOWING])
    assert state_at_end(story) in (State.FROZEN, State.WAITING)
    assert fault_of(story) is fault
    check_limits(story)


def state_at_end(story):
    return story.run.state[-1]


@pytest.mark.parametrize("jump_s", [-3600.0, -0.5, 0.5, 3600.0])
def test_a_clock_that_jumps_stops_the_robot_and_it_starts_softly_on_the_new_time(jump_s):
    story = followed()
    stamp_ns = story.now().ros_ns
    story.ros_ahead_ns = START_NS + round(jump_s * 1e9)

    story.go(0.3, hear=lambda: story.hear(stamp_ns=stamp_ns))
    assert state_at_end(story) is not State.FOLLOWING
    states = story.go(2.5)
    assert states[-3:] == START
    check_limits(story)


def test_another_persons_bones_stop_the_robot_until_it_is_let_go():
    story = followed()
    story.controller.add_urdf(person_urdf(1.1), story.now())

    story.go(2.0)
    assert (state_at_end(story), fault_of(story)) == (State.FROZEN, StopReason.PERSON_CHANGED)
    story.held = False
    story.go(0.1)
    story.held = True
    assert story.go(2.5)[-3:] == START
    check_limits(story)


def test_the_same_person_measured_anew_goes_on():
    story = followed()
    story.controller.add_urdf(person_urdf(1.001), story.now())

    assert story.go(0.5) == [State.FOLLOWING]


def test_a_jump_of_the_angles_becomes_no_jump_of_the_robot():
    story = followed()
    story.angles = lambda t: np.array([-0.8, 1.4, -0.9, 0.1])

    states = story.go(3.0)

    assert states[:2] in (STOP, [State.FOLLOWING, State.SLOWING])
    assert states[-1] is State.FOLLOWING
    check_limits(story)


def test_a_blocked_robot_stops_the_commands():
    story = followed()
    stuck = story.robot.position.copy()
    for _ in range(100):
        story.now_ns += 10_000_000
        story.hear()
        story.controller.add_robot(stuck + 0.8, story.now())
        story.controller.step(story.now(), True)

    assert fault_of(story) is StopReason.LAGS


def test_a_node_that_dies_leaves_a_trajectory_that_comes_to_rest():
    story = followed()
    before = len(story.run.state)

    story.robot.advance(1.0)  # nobody commands any more

    assert before == len(story.run.state)
    assert np.abs(story.robot.velocity).max() < 1e-3
    story.controller = Followed().controller
    story.controller.add_urdf(person_urdf(), story.now())
    assert story.go(2.0) == START
    check_limits(story)


def test_random_troubles_never_violate_a_limit():
    rng = np.random.default_rng(7)
    story = followed()
    for _ in range(6):
        happen = TROUBLES[sorted(TROUBLES)[rng.integers(len(TROUBLES))]][1]
        happen(story)
        story.held, story.stddev = rng.random() < 0.9, 0.02
        story.go(rng.uniform(0.2, 2.0))
        story.held = True
        story.go(rng.uniform(0.2, 2.0))

    check_limits(story)
