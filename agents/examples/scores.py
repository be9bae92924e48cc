"""Scores of saved weights, compared with an arm that holds still."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import faceoff
import numpy as np
import numpy.typing as npt

from network import SavedPolicy
from player import Player


class Hold:
    """The policy of agents/hold: keeps the first pose."""

    def reset(self, task: str, episode: int) -> None:
        """Begins an episode."""
        self.pose: npt.NDArray[np.float64] | None = None

    def __call__(self, observation: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        if self.pose is None:
            self.pose = observation[6:13].copy()
        return np.stack([self.pose, np.zeros(7)])


def score(policy: Callable[..., Any], episodes: int) -> dict[str, Any]:
    """The task result of `defend` in the profile `evaluation`, as by `faceoff eval --seed 0`."""
    result = faceoff.evaluate(
        policy, tasks="defend", episodes=episodes, interpolation=3, action_mode="raw", workers=2
    )
    task_result: dict[str, Any] = result["tasks"]["defend"]
    return task_result


def log_scores(weights: Path, episodes: int, log_line: Callable[[str], None]) -> None:
    """Logs the scores of the weights and of holding still."""
    for name, policy in (("weights.npz", Player(SavedPolicy(weights))), ("hold", Hold())):
        result = score(policy, episodes)
        low, high = (100.0 * bound for bound in result["success_ci95"])
        log_line(
            f"{name:12} defend, evaluation profile, seed 0, {episodes} episodes: "
            f"{100.0 * result['success_rate']:.1f} % ({low:.1f} to {high:.1f}), "
            f"{result['penalty_points']:.1f} penalty points"
        )
