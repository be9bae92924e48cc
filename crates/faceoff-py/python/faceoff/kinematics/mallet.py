"""Moves mallets over the table: converts desired velocities to joint commands that the arm can follow."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from . import model
from .arrays import Floats
from .poses import forward, inverse

#: Allowed region of the mallet, m in the robot's base frame: lowest and highest [x, y]. The end effector's constraint
#: begins 2 cm beyond it, except towards the middle of the table, where the arm's reach ends.
REGION = ((0.605, -0.45), (1.30, 0.45))
CONTROL_STEP_S = 0.02
#: Usable share of a joint's velocity limit. The constraint is 0.95; the rest is for the controller's overshoot.
SPEED_SHARE = 0.8
#: Along each axis. With a larger acceleration the arm leaves its height.
MAX_ACCELERATION_M_S2 = 8.0

#: From points (n, 2), m in the robot's base frame, to joint positions (n, 7), rad, and flags (n,) of valid solutions.
Inverse = Callable[[Floats], tuple[Floats, npt.NDArray[np.bool_]]]


class MalletMotion:
    """Commanded positions and velocities of the mallets of several worlds, and the joint commands for them.

    Most of the time of `command` goes into two calls of `inverse`; `faceoff.kinematics.native` has a faster one.
    """

    def __init__(self, worlds: int, max_speed_m_s: float, inverse: Inverse = inverse) -> None:
        self._max_speed_m_s = max_speed_m_s
        self._inverse = inverse
        self._start = np.array(model.START_Q)
        self._step_limits = SPEED_SHARE * np.array(model.VELOCITY_LIMIT_RAD_S) * CONTROL_STEP_S
        self._q = np.tile(self._start, (worlds, 1))
        self._xy = forward(self._q)[:, :2]
        self._speed = np.zeros((worlds, 2))

    @property
    def xy(self) -> Floats:
        """(worlds, 2): commanded positions of the mallets, m in the robot's base frame."""
        return self._xy.copy()

    @property
    def speed(self) -> Floats:
        """(worlds, 2): commanded velocities of the mallets, m/s."""
        return self._speed.copy()

    def restart(self, is_restarted: npt.NDArray[np.bool_]) -> None:
        """Moves the mallets of the worlds in the mask `is_restarted` (worlds,) to their start, at rest."""
        self._q[is_restarted] = self._start
        self._xy[is_restarted] = forward(self._start)[:2]
        self._speed[is_restarted] = 0.0

    def command(self, actions: Floats) -> Floats:
        """Converts (worlds, 2) shares of the maximum speed along x and y to (worlds, 14) raw actions.

        The motion is shortened where it would exceed the joints' speeds, the acceleration limit or the region.
        """
        lowest, highest = np.array(REGION)
        desired = np.clip(actions, -1.0, 1.0) * self._max_speed_m_s
        change_m_s = MAX_ACCELERATION_M_S2 * CONTROL_STEP_S
        speed = self._speed + np.clip(desired - self._speed, -change_m_s, change_m_s)
        # The largest speeds from which the mallet can still stop at the region's edges.
        max_down = np.sqrt(2.0 * MAX_ACCELERATION_M_S2 * np.maximum(self._xy - lowest, 0.0))
        max_up = np.sqrt(2.0 * MAX_ACCELERATION_M_S2 * np.maximum(highest - self._xy, 0.0))
        step = np.clip(speed, -max_down, max_up) * CONTROL_STEP_S
        step = np.clip(self._xy + step, lowest, highest) - self._xy
        q, _ = self._inverse(self._xy + step)
        excess = np.max(np.abs(q - self._q) / self._step_limits, axis=1, keepdims=True)
        # The step is shortened on the table, not in joint space, so that the mallet keeps its height.
        step /= np.maximum(excess, 1.0)
        q, is_solved = self._inverse(self._xy + step)
        step = np.where(is_solved[:, None], step, 0.0)
        change = np.where(is_solved[:, None], q - self._q, 0.0)
        self._xy = self._xy + step
        self._speed = step / CONTROL_STEP_S
        self._q = self._q + change
        return np.concatenate([self._q, change / CONTROL_STEP_S], axis=1)
