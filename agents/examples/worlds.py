"""The training environment for the task `defend`: many worlds (simulated tables), stepped together."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from faceoff.gym import AirHockeyVectorEnv, MalletPlaneVector, Transition

from player import MAX_SPEED_M_S
from view import FEATURE_COUNT, View

#: The table's centre in the robot's base frame, m.
TABLE_CENTRE_M = (1.51, 0.0)


def reward(transition: Transition) -> npt.NDArray[np.float64]:
    """1 for a success, plus a tenth of the speed (m/s) lost by the puck, minus a cost for a mallet beside its path.

    Without that cost some policies learn to stay away: a mallet that moves at random disturbs pucks that would have
    stopped without a contact, and rarely stops others.
    """
    before, after = transition.state.puck, transition.next_state.puck
    lost_speed_m_s = np.linalg.norm(before[:, 3:5], axis=1) - np.linalg.norm(after[:, 3:5], axis=1)
    mallet = transition.next_state.mallet[:, :2] - TABLE_CENTRE_M
    is_coming = (after[:, 3] < 0.0) & (after[:, 0] > mallet[:, 0])
    distance_m = np.where(is_coming, np.abs(after[:, 1] - mallet[:, 1]), 0.0)
    rewards: npt.NDArray[np.float64] = 1.0 * transition.success + 0.1 * lost_speed_m_s - 0.05 * distance_m
    return rewards


class DefendWorlds:
    """Episodes of `defend`, profile `evaluation`; actions are mallet velocities.

    Each world has another robot, or all have the one of `mismatch_seed`.
    """

    feature_count = FEATURE_COUNT
    actions = 2

    def __init__(self, worlds: int, mismatch_seed: str | None = None) -> None:
        self.worlds = worlds
        self._env = AirHockeyVectorEnv(
            worlds,
            "defend",
            action_mode="raw",
            interpolation=3,
            profile="evaluation",
            mismatch_seed=mismatch_seed,
            autoreset_mode="SameStep",
            reward=reward,
        )
        self._plane = MalletPlaneVector(self._env, MAX_SPEED_M_S)
        self._view = View(worlds)
        self._ended: list[tuple[bool, bool]] = []

    def reset(self, seed: int) -> npt.NDArray[np.float64]:
        """Begins an episode in each world; world i has the episodes of seed + i."""
        observations, _ = self._plane.reset(seed=seed)
        self._view.restart(np.ones(self.worlds, np.bool_))
        return self._features(observations)

    def _features(self, observations: npt.NDArray[np.float32]) -> npt.NDArray[np.float64]:
        motion = self._plane.motion
        return self._view.update(observations, motion.xy, motion.speed)

    def shares(self) -> tuple[float, float]:
        """Shares of successes and of violations among the episodes that ended since the last call."""
        succeeded, violated = np.mean(self._ended, axis=0) if self._ended else (np.nan, np.nan)
        self._ended.clear()
        return float(succeeded), float(violated)

    def step(
        self, actions: npt.NDArray[np.float32]
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
        """Features, rewards and ends of episodes; see :class:`ppo.Worlds`."""
        observations, rewards, terminated, truncated, infos = self._plane.step(actions)
        ended = terminated | truncated
        self._view.restart(ended)
        if ended.any():
            final = infos["final_info"]
            for world in np.flatnonzero(ended):
                self._ended.append((final["success"][world], final["violations"][world].any()))
        return self._features(observations), rewards, ended
