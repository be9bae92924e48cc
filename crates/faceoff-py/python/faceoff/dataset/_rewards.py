"""Rewards of recorded episodes for learners; evaluations have none."""

from __future__ import annotations

from typing import Callable

import numpy as np

from ._episode import Episode, EpisodeArrays
from ._errors import DatasetError
from ._rows import Floats

__all__ = ["Reward", "checked_rewards", "success_at_end"]

Reward = Callable[[Episode, EpisodeArrays], Floats]
"""Computes the rewards, shape (N,), of an episode of N control steps."""


def success_at_end(episode: Episode, arrays: EpisodeArrays) -> Floats:
    """1 at the last step of an episode that succeeded, 0 otherwise; shape (N,)."""
    out = np.zeros(len(arrays.actions))
    if episode.success and len(out):
        out[-1] = 1.0
    return out


def checked_rewards(reward: Reward, episode: Episode, arrays: EpisodeArrays) -> Floats:
    """The rewards of a reward function, after a check.

    Raises:
        DatasetError: the shape is wrong, or a reward is not finite.
    """
    out = np.asarray(reward(episode, arrays), dtype=np.float64)
    expected = (len(arrays.actions),)
    if out.shape != expected:
        raise DatasetError(f"{episode}: reward: expected shape {expected}, got {out.shape}")
    if not np.isfinite(out).all():
        raise DatasetError(f"{episode}: reward: expected finite numbers, got {out[~np.isfinite(out)][0]}")
    return out
