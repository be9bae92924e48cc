"""Moves mallets over the table: wanted velocities become joint positions and velocities that the arm can follow."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from faceoff.kinematics import model
from faceoff.kinematics.arrays import Floats
from faceoff.kinematics.poses import forward, inverse

#: Where the mallet may go, m in the robot's base frame: [x, y] least and greatest. The constraint on the end effector
#: begins 2 cm beyond it, but towards the middle of the table, where the arm's reach ends.
REGION = ((0.605, -0.45), (1.30, 0.45))
CONTROL_STEP_S = 0.02
#: Of a joint's velocity limit; the constraint is 0.95, and an arm that is pushed on overshoots.
SPEED_SHARE = 0.8
#: Along each axis. An arm that is asked for more sags out of its height.
MAX_ACCELERATION_M_S2 = 8.0

#: From points (n, 2), m in the robot's base frame, to joint positions (n, 7), rad, and (n,) whether they are good.
Inverse = Callable[[Floats], tuple[Floats, npt.NDArray[np.bool_]]]


class MalletMotion:
    """Where the mallets of some worlds are commanded to be, and the joints that bring them there.

    Most of a command's time goes into two batches of `inverse`; `faceoff.kinematics.native` has a faster one.
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
        """(worlds, 2): where the mallets are commanded to be, m in the robot's base frame."""
        return self._xy.copy()

    @property
    def speed(self) -> Floats:
        """(worlds, 2): how fast they are commanded to move, m/s."""
        return self._speed.copy()

    def restart(self, which: npt.NDArray[np.bool_]) -> None:
        """These worlds begin an episode: their mallets are where they start."""
        self._q[which] = self._start
        self._xy[which] = forward(self._start)[:2]
        self._speed[which] = 0.0

    def command(self, actions: Floats) -> Floats:
        """From (worlds, 2) fractions of the greatest speed along x and y to (worlds, 14) raw actions.

        A mallet that would be too fast for its joints, would gain speed too fast or would leave its region gets as far as
        it can.
        """
        least, greatest = np.array(REGION)
        wanted = np.clip(actions, -1.0, 1.0) * self._max_speed_m_s
        change_m_s = MAX_ACCELERATION_M_S2 * CONTROL_STEP_S
        speed = self._speed + np.clip(wanted - self._speed, -change_m_s, change_m_s)
        # So slow towards the region's edge that it can stop there.
        slow = np.sqrt(2.0 * MAX_ACCELERATION_M_S2 * np.maximum(self._xy - least, 0.0))
        fast = np.sqrt(2.0 * MAX_ACCELERATION_M_S2 * np.maximum(greatest - self._xy, 0.0))
        step = np.clip(speed, -slow, fast) * CONTROL_STEP_S
        step = np.clip(self._xy + step, least, greatest) - self._xy
        q, _ = self._inverse(self._xy + step)
        excess = np.max(np.abs(q - self._q) / self._step_limits, axis=1, keepdims=True)
        # Shortened along the table, not in the joints, so that the mallet keeps its height.
        step /= np.maximum(excess, 1.0)
        q, is_good = self._inverse(self._xy + step)
        step = np.where(is_good[:, None], step, 0.0)
        change = np.where(is_good[:, None], q - self._q, 0.0)
        self._xy = self._xy + step
        self._speed = step / CONTROL_STEP_S
        self._q = self._q + change
        return np.concatenate([self._q, change / CONTROL_STEP_S], axis=1)
