"""The simulated robot follows any command within its limits for any integration step."""

import numpy as np
import pytest

from pose_teleop.arm_controller import command_limits
from pose_teleop.motion_limiter import MotionLimiter
from pose_teleop.parameters import ArmParameters
from pose_teleop.robot_arm import RobotArm
from pose_teleop.robot_dynamics import SimulatedArm
from pose_teleop.robot_files import load_robot

pytest.importorskip("ruckig")
pytest.importorskip("pinocchio")
PERIOD_S, STOP_STEP_S = 0.01, 0.02
NEXT_TARGET = 100  # [periods]


def follow_random_targets(robot, seed, step_s=0.002, **parameters):
    """Ten seconds; the largest lag behind the command [rad] and speed over the URDF's limit."""
    arm, rng = RobotArm(load_robot(robot, "left")), np.random.default_rng(seed)
    limits = command_limits(arm, ArmParameters(robot=robot, mode="wrist", **parameters))
    limiter, simulated = MotionLimiter(limits), SimulatedArm(arm, 0.1, step_s)
    limiter.reset(simulated.position)
    lag = speed = 0.0
    for period in range(1000):
        if period % NEXT_TARGET == 0:
            target = rng.uniform(limits.lower, limits.upper)
        motions = [limiter.follow(target, np.zeros(len(target)), PERIOD_S)]
        motions += limiter.way_to_stop(STOP_STEP_S)
        simulated.command(
            PERIOD_S + STOP_STEP_S * np.arange(len(motions)),
            np.array([motion.position for motion in motions]),
            np.array([motion.velocity for motion in motions]),
        )
        simulated.advance(PERIOD_S)
        lag = max(lag, np.abs(simulated.position - motions[0].position).max())
        speed = max(speed, (np.abs(simulated.velocity) / arm.max_velocity).max())
    return lag, speed


@pytest.mark.parametrize("seed", [1, 4])  # of the Panda, those that ask for most torque
@pytest.mark.parametrize("robot", ["g1", "panda"])
def test_random_targets_are_followed_within_the_robots_limits(robot, seed):
    lag, speed = follow_random_targets(robot, seed)

    assert np.degrees(lag) < 1.5
    assert speed < 1.0


@pytest.mark.parametrize("step_s", [0.001, 0.002, 0.005])
def test_commands_beyond_the_motors_torques_are_lagged_behind_and_nothing_diverges(step_s):
    lag, speed = follow_random_targets("panda", 4, step_s, max_acceleration=10.0)

    assert 2.0 < np.degrees(lag) < 20.0
    assert speed < 3.0


@pytest.mark.parametrize("robot", ["g1", "panda"])
def test_a_command_far_away_is_reached_within_the_robots_velocity(robot):
    arm = RobotArm(load_robot(robot, "left"))
    simulated = SimulatedArm(arm, 0.1)
    goal = np.clip(arm.rest + 1.0, arm.lower, arm.upper)
    simulated.command(np.array([0.01]), goal[None], np.zeros((1, len(goal))))
    for _ in range(200):
        simulated.advance(PERIOD_S)
        assert (np.abs(simulated.velocity) <= 1.01 * arm.max_velocity).all()  # masses misjudged

    assert np.degrees(np.abs(simulated.position - goal).max()) < 2.0
