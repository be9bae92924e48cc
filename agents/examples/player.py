"""A trained policy, as `faceoff.evaluate` plays it and as the agent of a bundle asks it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from faceoff.kinematics import MalletMotion

from view import View

#: What an action of 1 stands for.
MAX_SPEED_M_S = 1.5
EVERY = np.ones(1, np.bool_)

#: From what is seen (1, LENGTH), float32, to how the mallet shall move (1, 2), shares of MAX_SPEED_M_S.
Decide = Callable[[npt.NDArray[np.float32]], npt.NDArray[np.float32]]


class Player:
    """From observations to joint positions and velocities."""

    def __init__(self, decide: Decide) -> None:
        self._decide = decide
        self._view = View(1)
        self._motion = MalletMotion(1, MAX_SPEED_M_S)

    def reset(self, task: str = "", episode: int = 0) -> None:
        """An episode begins."""
        self._view.restart(EVERY)
        self._motion.restart(EVERY)

    def __call__(self, observation: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """(2, 7): positions and velocities at the end of the step."""
        seen = np.asarray(observation, np.float64)[None, :20]
        view = self._view.look(seen, self._motion.xy, self._motion.speed)
        command = self._motion.command(self._decide(view.astype(np.float32)).astype(np.float64))
        return command.reshape(2, 7)
