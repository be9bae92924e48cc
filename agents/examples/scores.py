"""How good saved weights are, beside an arm that holds still."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import faceoff
import numpy as np
import numpy.typing as npt

from network import Saved
from player import Player


class Hold:
    """As agents/hold: the pose that it saw first."""

    def reset(self, task: str, episode: int) -> None:
        """An episode begins."""
        self.pose: npt.NDArray[np.float64] | None = None

    def __call__(self, observation: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        if self.pose is None:
            self.pose = observation[6:13].copy()
        return np.stack([self.pose, np.zeros(7)])


def score(policy: Callable[..., Any], episodes: int) -> dict[str, Any]:
    """Of `defend` in the profile that counts, as `faceoff eval --seed 0` plays it."""
    result = faceoff.evaluate(
        policy, tasks="defend", episodes=episodes, interpolation=3, action_mode="raw", workers=2
    )
    scored: dict[str, Any] = result["tasks"]["defend"]
    return scored


def tell(weights: Path, episodes: int, say: Callable[[str], None]) -> None:
    """Says what the weights reach, and holding."""
    for name, policy in (("weights.npz", Player(Saved(weights))), ("hold", Hold())):
        scored = score(policy, episodes)
        low, high = (100.0 * bound for bound in scored["success_ci95"])
        say(
            f"{name:12} defend, evaluation profile, seed 0, {episodes} episodes: {100.0 * scored['success_rate']:.1f} % "
            f"({low:.1f} to {high:.1f}), {scored['penalty_points']:.1f} penalty points"
        )
