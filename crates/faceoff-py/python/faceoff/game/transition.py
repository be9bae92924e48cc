"""Control steps of games as reward functions see them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

#: Both robots, robot 1 first.
AGENTS = ("robot_1", "robot_2")
#: Control steps of the competition's games: 15 minutes.
GAME_STEPS = 45_000

Observation = npt.NDArray[np.float32]


@dataclass(frozen=True)
class GameTransition:
    """A control step of a game, for a reward function. In pairs robot 1 comes first.

    In an environment of many games each array has the games first, and ``rally_end`` and ``by`` are arrays.
    """

    #: (2, 23) observations of both robots before the step, float32.
    observations: Observation
    #: (2, 23) observations after the step, float32; those of the next rally if one has begun.
    next_observations: Observation
    #: (6,) the puck after the step, before the next rally begins: x, y, yaw, vx, vy, yaw rate in the table's frame.
    puck: npt.NDArray[np.float64]
    #: (2, 17) joint positions (7) and velocities (7), and the end effector (3) in the robot's own base frame.
    robots: npt.NDArray[np.float64]
    #: (2, 4) values in the order of :data:`faceoff.gym.CONSTRAINTS`; above 0 is a violation.
    constraints: npt.NDArray[np.float64]
    #: How the rally ended: goal, foul, stuck, left_table or diverged; None while it is under way.
    rally_end: Any
    #: The robot (0 or 1) that scored, or on whose side the puck stayed too long; None, or -1 in arrays, without one.
    by: Any
    #: (2,) points that the step added to each side: goals, and one for every third foul of the opponent.
    points: npt.NDArray[np.int64]
    #: (2,) whether the robot's commands made the world diverge.
    diverged: npt.NDArray[np.bool_]


GameReward = Callable[[GameTransition], Any]


def default_reward(transition: GameTransition) -> npt.NDArray[np.float64]:
    """(2,): points gained minus the opponent's; minus 10 for a robot that made the world diverge."""
    gained = transition.points.astype(np.float64)
    rewards: npt.NDArray[np.float64] = gained - gained[..., ::-1] - 10.0 * transition.diverged
    return rewards
