"""The results of a step as arrays with a row per world (simulated table). The native half, compiled from Rust, writes them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from faceoff import _native

Floats = npt.NDArray[np.float64]
Singles = npt.NDArray[np.float32]
Bools = npt.NDArray[np.bool_]


@dataclass
class Rows:
    """Results of a step: a row per world."""

    observations: Singles
    #: Last observations of episodes whose successor has begun in the same step.
    final_observations: Singles
    rewards: Floats
    terminated: Bools
    truncated: Bools
    #: (worlds, 12): numbers about each world's episode, which the properties below name.
    episode_info: Floats
    #: (worlds, 33): true states after the step.
    states: Floats
    #: (worlds, 33): present true states, those of the new episode where one has begun.
    next_states: Floats

    @classmethod
    def make(cls, worlds: int, observation_len: int, *, final_observations: bool, states: bool) -> Rows:
        """Zeroed arrays for that many worlds; final observations and true states are empty unless requested."""
        state_rows = worlds if states else 0
        return cls(
            np.zeros((worlds, observation_len), np.float32),
            np.zeros((worlds if final_observations else 0, observation_len), np.float32),
            np.zeros(worlds),
            np.zeros(worlds, np.bool_),
            np.zeros(worlds, np.bool_),
            np.zeros((worlds, _native.EPISODE_INFO_LEN)),
            np.zeros((state_rows, _native.STATE_LEN)),
            np.zeros((state_rows, _native.STATE_LEN)),
        )

    def renew(self) -> None:
        """Allocates new arrays for the results that callers keep."""
        self.rewards = np.empty_like(self.rewards)
        self.terminated = np.empty_like(self.terminated)
        self.truncated = np.empty_like(self.truncated)

    def arrays(self) -> tuple[Any, ...]:
        """All arrays in the order that the native half expects."""
        return (
            self.observations,
            self.final_observations,
            self.rewards,
            self.terminated,
            self.truncated,
            self.episode_info,
            self.states,
            self.next_states,
        )

    @property
    def ends(self) -> npt.NDArray[np.int64]:
        """[worlds] index into ``_native.ENDS``, -1 while the episode is under way."""
        return self.episode_info[:, 0].astype(np.int64)

    @property
    def success(self) -> Bools:
        """[worlds] whether the episode has ended in success."""
        return self.episode_info[:, 1] > 0.0

    @property
    def numbers(self) -> npt.NDArray[np.int64]:
        """[worlds] the episode's number; at an end that of the ended episode."""
        return self.episode_info[:, 2].astype(np.int64)

    @property
    def steps(self) -> npt.NDArray[np.int64]:
        """[worlds] control steps of the episode so far."""
        return self.episode_info[:, 3].astype(np.int64)

    @property
    def constraints(self) -> Floats:
        """[worlds][4] values of the constraints, a copy."""
        return self.episode_info[:, 4:8].copy()

    @property
    def violations(self) -> Bools:
        """[worlds][4] whether each constraint was violated in the episode."""
        return self.episode_info[:, 8:12] > 0.0
