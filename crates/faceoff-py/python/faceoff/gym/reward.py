"""What reward functions are told."""

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
    """True state of one world, or of many: then each array has the worlds first. SI units, radians.

    It is what the simulator knows, not what the agent is told: without noise, delay and lost pucks.
    """

    #: (…, 33)
    array: Floats

    @property
    def puck(self) -> Floats:
        """(…, 6): x, y, yaw, vx, vy, yaw rate, in the table's frame (origin in its middle, x to the opponent)."""
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
        """(…, 7): joint velocities as they are observed and judged, without noise."""
        return self.array[..., 20:27]

    @property
    def mallet(self) -> Floats:
        """(…, 3): the end effector, in the robot's base frame; the table's middle is at (1.51, 0, 0.1)."""
        return self.array[..., 27:30]

    @property
    def opponent(self) -> Floats:
        """(…, 3): the opponent's end effector in its own base frame; zero without one."""
        return self.array[..., 30:33]


@dataclass(frozen=True)
class Transition:
    """A control step of one world, or of many: then each array has the worlds first."""

    #: (…, 20 or 23) what the agent was told before, float32.
    observation: npt.NDArray[np.float32]
    #: (…, n) the action as it was given.
    action: Floats
    #: (…, 20 or 23) what the step led to, float32; at an end the last observation of the episode.
    next_observation: npt.NDArray[np.float32]
    #: The true state before.
    state: State
    #: The true state that the step led to.
    next_state: State
    #: (…, 4) values in the order of :data:`CONSTRAINTS`; broken where above 0.
    constraints: Floats
    #: (…, 4) broken in this episode so far.
    violations: npt.NDArray[np.bool_]
    #: The episode ended in success.
    success: npt.NDArray[np.bool_]
    terminated: npt.NDArray[np.bool_]
    truncated: npt.NDArray[np.bool_]


#: From a transition to a number, or for many worlds to an array with one for each.
Reward = Callable[[Transition], Any]
