"""A trained policy for `faceoff.evaluate` and for the agent of a bundle."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from faceoff.kinematics import MalletMotion

from view import View

#: Mallet speed of an action of 1.
MAX_SPEED_M_S = 1.5
ALL_WORLDS = np.ones(1, np.bool_)

#: From features (1, LENGTH), float32, to mallet velocities (1, 2) as shares of MAX_SPEED_M_S.
Decide = Callable[[npt.NDArray[np.float32]], npt.NDArray[np.float32]]


class Player:
    """A policy from observations to joint positions and velocities."""

    def __init__(self, decide: Decide) -> None:
        self._decide = decide
        self._view = View(1)
        self._motion = MalletMotion(1, MAX_SPEED_M_S)

    def reset(self, task: str = "", episode: int = 0) -> None:
        """Begins an episode."""
        self._view.restart(ALL_WORLDS)
        self._motion.restart(ALL_WORLDS)

    def __call__(self, observation: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """(2, 7): positions and velocities at the end of the step."""
        observations = np.asarray(observation, np.float64)[None, :20]
        view = self._view.update(observations, self._motion.xy, self._motion.speed)
        command = self._motion.command(self._decide(view.astype(np.float32)).astype(np.float64))
        return command.reshape(2, 7)
