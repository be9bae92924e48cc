"""The arrays that the native half writes."""

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
    """What a step leads to: a row per world."""

    observations: Singles
    final_observations: Singles
    rewards: Floats
    terminated: Bools
    truncated: Bools
    facts: Floats
    states: Floats
    next_states: Floats

    @classmethod
    def make(cls, worlds: int, observation_len: int, *, finals: bool, states: bool) -> Rows:
        """For so many worlds; final observations and true states only where they are asked for."""
        state_rows = worlds if states else 0
        return cls(
            np.zeros((worlds, observation_len), np.float32),
            np.zeros((worlds if finals else 0, observation_len), np.float32),
            np.zeros(worlds),
            np.zeros(worlds, np.bool_),
            np.zeros(worlds, np.bool_),
            np.zeros((worlds, _native.FACTS)),
            np.zeros((state_rows, _native.STATE_LEN)),
            np.zeros((state_rows, _native.STATE_LEN)),
        )

    def renew(self) -> None:
        """New memory for what users get: they may keep what they got before."""
        self.observations = np.empty_like(self.observations)
        self.rewards = np.empty_like(self.rewards)
        self.terminated = np.empty_like(self.terminated)
        self.truncated = np.empty_like(self.truncated)

    def arrays(self) -> tuple[Any, ...]:
        """In the order of the native half."""
        return (
            self.observations,
            self.final_observations,
            self.rewards,
            self.terminated,
            self.truncated,
            self.facts,
            self.states,
            self.next_states,
        )

    @property
    def ends(self) -> npt.NDArray[np.int64]:
        """[worlds] index into ``_native.ENDS``, -1 while the episode is under way."""
        return self.facts[:, 0].astype(np.int64)

    @property
    def success(self) -> Bools:
        """[worlds] the episode has ended in success."""
        return self.facts[:, 1] > 0.0

    @property
    def numbers(self) -> npt.NDArray[np.int64]:
        """[worlds] the episode's number; the one that has ended, at an end."""
        return self.facts[:, 2].astype(np.int64)

    @property
    def steps(self) -> npt.NDArray[np.int64]:
        """[worlds] control steps of that episode."""
        return self.facts[:, 3].astype(np.int64)

    @property
    def constraints(self) -> Floats:
        """[worlds][4] a copy."""
        return self.facts[:, 4:8].copy()

    @property
    def violations(self) -> Bools:
        """[worlds][4]"""
        return self.facts[:, 8:12] > 0.0
