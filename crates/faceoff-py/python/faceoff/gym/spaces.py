"""Spaces of observations and actions."""

from __future__ import annotations

import numpy as np
from gymnasium.spaces import Box

from faceoff import _native
from faceoff._arguments import action_len


def observation_space(task: str) -> Box:
    """(23,) for ``hit``, else (20,), float32, with finite bounds."""
    bounds = np.array(_native.observation_bounds(), np.float32)[: 23 if task == "hit" else 20]
    return Box(bounds[:, 0], bounds[:, 1], dtype=np.float32)


def game_observation_space() -> Box:
    """(23,), float32, with finite bounds."""
    return observation_space("hit")


def action_space(interpolation: int | None, action_mode: str) -> Box:
    """(n,), float32: within [-1, 1], or for ``raw`` within the joints' limits."""
    length = action_len(interpolation)
    if action_mode != "raw":
        return Box(-1.0, 1.0, (length,), np.float32)
    limits = np.array(_native.joint_limits(), np.float32)
    quantities = min(3, length // 7)
    high = np.tile(limits[:quantities].ravel(), length // (7 * quantities))
    return Box(-high, high, dtype=np.float32)
