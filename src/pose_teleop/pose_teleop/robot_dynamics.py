"""A simulated arm: rigid-body dynamics with a controller whose masses have errors.

Forward dynamics by the articulated-body algorithm (Featherstone 2008, chapter 7), joint torques by
computed torque with the URDF's effort limits, semi-implicit Euler steps.
"""

from functools import partial

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from pose_core.api import FloatArray
from pose_teleop.extras import require
from pose_teleop.robot_arm import RobotArm

STEP_S = 0.002  # [s] of the integration
STIFFNESS = 40.0**2  # [1/s2] of the controller, on the joint's inertia
DAMPING = 2.0 * 40.0  # [1/s] critical
ROTOR_INERTIA = 0.02  # [kg m2] of every motor behind its gear; not part of URDF
GOVERNED = 0.98  # [-] share of the velocity limits that the drives allow; their model is not exact
FEED_FORWARD = 2.0  # [-] largest feed-forward acceleration, relative to the limit


class SimulatedArm:
    """Executes trajectories like a joint trajectory controller; at their end it is at rest.

    Attributes:
        position, velocity: Joint angles [rad] and velocities [rad/s], (n,).

    Args:
        arm: The robot's arm.
        mass_error: Relative error of the masses in its controller [-].
        step_s: Time step of the integration [s].
    """

    def __init__(self, arm: RobotArm, mass_error: float, step_s: float = STEP_S) -> None:
        self._step_s = step_s
        self._pin = require("pinocchio")
        self._arm = arm
        self._model = arm.model.copy()
        self._data = self._model.createData()
        self._assumed = self._model.copy()
        for inertia in self._assumed.inertias:
            inertia.mass *= 1.0 + mass_error
            inertia.inertia = inertia.inertia * (1.0 + mass_error)
        self._assumed_data = self._assumed.createData()
        self.position, self.velocity = arm.rest.copy(), np.zeros(len(arm.rest))
        self._reference = arm.rest.copy(), np.zeros(len(arm.rest))
        self._trajectory: CubicHermiteSpline | None = None
        self._begun_s = 0.0
        self._time_s = 0.0

    def command(self, times_s: FloatArray, position: FloatArray, velocity: FloatArray) -> None:
        """Replace the current trajectory by k points of n joints.

        Args:
            times_s: [s] from now, increasing, (k,).
            position: [rad] (k, n).
            velocity: [rad/s] (k, n).
        """
        begin, begin_velocity = self._reference
        self._trajectory = CubicHermiteSpline(
            np.concatenate([[0.0], times_s]),
            np.vstack([begin, position]),
            np.vstack([begin_velocity, velocity]),
        )
        self._begun_s = self._time_s

    def advance(self, duration_s: float) -> None:
        """Simulate ``duration_s`` [s]."""
        for _ in range(max(1, round(duration_s / self._step_s))):
            self._time_s += self._step_s
            self._step()

    def _step(self) -> None:
        before, rate_before = self._reference
        wanted, rate = self._referred()
        # A late or distant command must not make the controller's reference jump.
        fastest = GOVERNED * self._arm.max_velocity
        reached = before + np.clip(wanted - before, -fastest * self._step_s, fastest * self._step_s)
        rate = np.where(reached == wanted, rate, (reached - before) / self._step_s)
        wanted, rate = reached, np.clip(rate, -fastest, fastest)
        self._reference = wanted, rate
        top = FEED_FORWARD * self._arm.file.max_acceleration
        acceleration = np.clip((rate - rate_before) / self._step_s, -top, top)
        wished = acceleration + STIFFNESS * (wanted - self.position)
        wished = wished + DAMPING * (rate - self.velocity)
        # The drives limit the joints' velocity.
        room = np.stack([-fastest - self.velocity, fastest - self.velocity]) / self._step_s
        wished = np.clip(wished, *room)
        arm, pin = self._arm, self._pin
        q, v = arm.model_order(self.position), arm.model_order(self.velocity)
        # The motors' inertia is added here: Pinocchio 2, used with numpy 1, does not support it.
        inertia = pin.crba(self._model, self._data, q)
        inertia = np.triu(inertia) + np.triu(inertia, 1).T + ROTOR_INERTIA * np.eye(len(v))
        bias = pin.nonLinearEffects(self._model, self._data, q, v)
        acceleration = np.linalg.solve(inertia, self._torque(q, v, arm.model_order(wished)) - bias)
        self.velocity = self.velocity + self._step_s * arm.our_order(acceleration)
        moved = self.position + self._step_s * self.velocity
        self.position = np.clip(moved, arm.lower, arm.upper)  # mechanical stops of the joints
        self.velocity = np.where(moved == self.position, self.velocity, 0.0)

    def _torque(self, q: FloatArray, v: FloatArray, wished: FloatArray) -> FloatArray:
        """Torques [N m] for desired accelerations [rad/s2], all in pinocchio's order, (n,).

        Beyond an effort limit all accelerations are scaled by the same factor: to limit the
        torque of one joint would accelerate the others in wrong directions.
        """
        rnea = partial(self._pin.rnea, self._assumed, self._assumed_data, q, v)
        still = rnea(np.zeros_like(wished)).copy()  # gravity and Coriolis
        moving = rnea(wished) - still + ROTOR_INERTIA * wished
        most = self._arm.model_order(self._arm.max_effort)
        room = np.maximum(np.where(moving > 0.0, most - still, most + still), 0.0)
        share = min(1.0, float((room / np.maximum(np.abs(moving), 1e-9)).min()))
        return np.clip(still + share * moving, -most, most)

    def _referred(self) -> tuple[FloatArray, FloatArray]:
        """Current position and velocity of the trajectory, cubic between its points."""
        position = self._reference[0]
        if self._trajectory is None:
            return position, np.zeros_like(position)
        t, end = self._time_s - self._begun_s, self._trajectory.x[-1]
        if t >= end:
            return self._trajectory(end), np.zeros_like(position)
        return self._trajectory(t), self._trajectory(t, 1)
