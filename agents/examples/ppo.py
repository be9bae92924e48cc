"""Proximal policy optimisation (Schulman and others, 2017) of many worlds at once, in NumPy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from network import Adam, Floats, Network, Normalisation

Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Settings:
    """What is set; the rest follows."""

    steps_per_round: int = 64
    epochs: int = 5
    minibatch: int = 4096
    rate: float = 7e-4
    discount: float = 0.99
    trace: float = 0.95
    clip: float = 0.2
    max_norm: float = 0.5
    first_log_deviation: float = -0.7
    last_log_deviation: float = -2.3
    hidden: tuple[int, ...] = (64, 64)


class Worlds(Protocol):
    """What is learned in."""

    worlds: int
    view_length: int
    actions: int

    def reset(self, seed: int) -> npt.NDArray[np.floating]:
        """Begins; what is seen, (worlds, view_length)."""

    def step(
        self, actions: Floats
    ) -> tuple[npt.NDArray[np.floating], npt.NDArray[np.floating], Bools]:
        """What is seen, rewards, and whose episode has ended (what is seen there is the next one's)."""


class Learner:
    """A policy, a critic, and what improves them."""

    def __init__(self, worlds: Worlds, settings: Settings, seed: int) -> None:
        self.settings = settings
        self._worlds = worlds
        self._rng = np.random.default_rng(seed)
        sizes = (worlds.view_length, *settings.hidden)
        self.policy = Network((*sizes, worlds.actions), self._rng, last_scale=0.01)
        self.critic = Network((*sizes, 1), self._rng, last_scale=1.0)
        self.normalisation = Normalisation(worlds.view_length)
        # Apart, so that neither's gradient bounds the other's.
        self._policy_adam = Adam(self.policy.parameters(), settings.max_norm)
        self._critic_adam = Adam(self.critic.parameters(), settings.max_norm)
        self._seen = self.normalisation(worlds.reset(seed))
        # Before anything is learned: what a first round sees through no normalisation would saturate the network.
        self._play(np.float32(np.exp(settings.first_log_deviation)))

    def round(self, progress: float) -> None:
        """Plays some steps in every world and learns from them; `progress` goes from 0 to 1."""
        given = self.settings
        log_deviation = (1.0 - progress) * given.first_log_deviation + progress * given.last_log_deviation
        played = self._play(np.float32(np.exp(log_deviation)))
        advantages, returns = self._advantages(*played[2:])
        self._learn(played[0], played[1], advantages, returns, np.exp(log_deviation), given.rate * (1.0 - progress))

    def _play(self, deviation: np.float32) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        steps, worlds = self.settings.steps_per_round, self._worlds.worlds
        seen = np.empty((steps, worlds, self._worlds.view_length), np.float32)
        noises = np.empty((steps, worlds, self._worlds.actions), np.float32)
        rewards = np.empty((steps, worlds), np.float32)
        goes_on = np.empty((steps, worlds), np.float32)
        raws = []
        for step in range(steps):
            seen[step] = self._seen
            noises[step] = self._rng.standard_normal(noises.shape[1:], np.float32)
            raw, reward, ended = self._worlds.step(self.policy(self._seen) + deviation * noises[step])
            raws.append(raw)
            rewards[step] = reward
            goes_on[step] = ~ended
            self._seen = self.normalisation(raw)
        self.normalisation.see(np.concatenate(raws))
        flat = np.concatenate([seen.reshape(-1, seen.shape[-1]), self._seen])
        values = self.critic(flat).reshape(steps + 1, worlds)
        return seen, noises, rewards, goes_on, values

    def _advantages(self, rewards: Floats, goes_on: Floats, values: Floats) -> tuple[Floats, Floats]:
        given = self.settings
        advantages = np.empty_like(rewards)
        following = np.zeros(rewards.shape[1], np.float32)
        for step in reversed(range(len(rewards))):
            surprise = rewards[step] + given.discount * goes_on[step] * values[step + 1] - values[step]
            following = surprise + given.discount * given.trace * goes_on[step] * following
            advantages[step] = following
        return advantages, advantages + values[:-1]

    def _learn(
        self, seen: Floats, noises: Floats, advantages: Floats, returns: Floats, deviation: float, rate: float
    ) -> None:
        given = self.settings
        seen = seen.reshape(-1, seen.shape[-1])
        noises = noises.reshape(-1, noises.shape[-1])
        actions = self.policy(seen) + np.float32(deviation) * noises
        before = -0.5 * (noises**2).sum(axis=1)
        gains, goals = advantages.reshape(-1), returns.reshape(-1)
        for _ in range(given.epochs):
            order = self._rng.permutation(len(seen))
            for first in range(0, len(order), given.minibatch):
                some = order[first : first + given.minibatch]
                gain = gains[some]
                gain = (gain - gain.mean()) / (gain.std() + 1e-8)
                layers = self.policy.layers(seen[some])
                off = (actions[some] - layers[-1]) / np.float32(deviation)
                ratio = np.exp(-0.5 * (off**2).sum(axis=1) - before[some])
                # Where the clipped objective is the smaller one, it has no gradient.
                held = np.where(gain > 0.0, ratio > 1.0 + given.clip, ratio < 1.0 - given.clip)
                pull = np.where(held, 0.0, gain * ratio) / len(some)
                policy = self.policy.gradients(layers, -(pull[:, None] * off / np.float32(deviation)).astype(np.float32))
                layers = self.critic.layers(seen[some])
                error = (layers[-1][:, 0] - goals[some]) / len(some)
                critic = self.critic.gradients(layers, error[:, None].astype(np.float32))
                self._policy_adam.step(policy, rate)
                self._critic_adam.step(critic, rate)
