"""Plays with a trained policy, in `faceoff.evaluate` and in the agent of a bundle: observations in, arm commands out."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from faceoff.kinematics import MalletMotion

from view import View

#: Mallet speed for the policy's output 1.
MAX_SPEED_M_S = 1.5
#: Mask of worlds for `restart`: this module plays in one world.
ONLY_WORLD = np.ones(1, np.bool_)

#: From features (1, FEATURE_COUNT), float32, to mallet velocities (1, 2) as shares of MAX_SPEED_M_S.
PolicyFunction = Callable[[npt.NDArray[np.float32]], npt.NDArray[np.float32]]


class Player:
    """A policy from observations to joint positions and velocities."""

    def __init__(self, policy: PolicyFunction) -> None:
        self._policy = policy
        self._view = View(1)
        self._motion = MalletMotion(1, MAX_SPEED_M_S)

    def reset(self, task: str = "", episode: int = 0) -> None:
        """Begins an episode."""
        self._view.restart(ONLY_WORLD)
        self._motion.restart(ONLY_WORLD)

    def __call__(self, observation: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Returns (2, 7): joint positions and velocities at the end of the control step."""
        observations = np.asarray(observation, np.float64)[None, :20]
        features = self._view.update(observations, self._motion.xy, self._motion.speed)
        command = self._motion.command(self._policy(features.astype(np.float32)).astype(np.float64))
        return command.reshape(2, 7)
