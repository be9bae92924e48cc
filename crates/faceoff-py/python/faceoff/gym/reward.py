"""Arguments of reward functions: true states and transitions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

#: The order of constraint values and violations.
CONSTRAINTS = ("ee", "link", "joint_pos", "joint_vel")

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class State:
    """True state of one world, or of many with the world as first dimension. SI units, radians.

    These are the simulator's values; observations add noise, delay and losses of the puck.
    """

    #: (…, 33), the parts below in their order.
    array: Floats

    @property
    def puck(self) -> Floats:
        """(…, 6): x, y, yaw, vx, vy, yaw rate, in the table's frame (origin at its centre, x towards the opponent)."""
        return self.array[..., :6]

    @property
    def q(self) -> Floats:
        """(…, 7): joint positions."""
        return self.array[..., 6:13]

    @property
    def dq(self) -> Floats:
        """(…, 7): joint velocities."""
        return self.array[..., 13:20]

    @property
    def dq_filtered(self) -> Floats:
        """(…, 7): joint velocities after the low-pass filter of observations and constraints, without noise."""
        return self.array[..., 20:27]

    @property
    def mallet(self) -> Floats:
        """(…, 3): the end effector, in the robot's base frame; the table's centre is at (1.51, 0, 0.1)."""
        return self.array[..., 27:30]

    @property
    def opponent(self) -> Floats:
        """(…, 3): the opponent's end effector in its own base frame; zero without one."""
        return self.array[..., 30:33]


@dataclass(frozen=True)
class Transition:
    """A control step of one world, or of many with the world as first dimension."""

    #: (…, 20 or 23) the observation before the step, float32.
    observation: npt.NDArray[np.float32]
    #: (…, n) the action as the caller passed it.
    action: Floats
    #: (…, 20 or 23) the observation after the step, float32; at an end the last one of the episode.
    next_observation: npt.NDArray[np.float32]
    #: The true state before the step.
    state: State
    #: The true state after the step, before a next episode begins.
    next_state: State
    #: (…, 4) values in the order of :data:`CONSTRAINTS`; above 0 is a violation.
    constraints: Floats
    #: (…, 4) whether each constraint was violated in this episode so far.
    violations: npt.NDArray[np.bool_]
    #: Whether the episode ended in success.
    success: npt.NDArray[np.bool_]
    terminated: npt.NDArray[np.bool_]
    truncated: npt.NDArray[np.bool_]


#: From a transition to a number, or for many worlds to an array of shape (num_envs,).
Reward = Callable[[Transition], Any]
