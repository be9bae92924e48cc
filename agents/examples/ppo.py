"""Proximal policy optimisation (Schulman et al., 2017) on many worlds in parallel, in NumPy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from network import Adam, Floats, Network, Normalisation

Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Settings:
    """Hyperparameters."""

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
    """Interface of the training environment."""

    worlds: int
    view_length: int
    actions: int

    def reset(self, seed: int) -> npt.NDArray[np.floating]:
        """Begins an episode in each world; returns features (worlds, view_length)."""

    def step(
        self, actions: Floats
    ) -> tuple[npt.NDArray[np.floating], npt.NDArray[np.floating], Bools]:
        """Features, rewards and ends of episodes; after an end, features are those of the next episode."""


class Learner:
    """A policy and a critic with their optimisers."""

    def __init__(self, worlds: Worlds, settings: Settings, seed: int) -> None:
        self.settings = settings
        self._worlds = worlds
        self._rng = np.random.default_rng(seed)
        sizes = (worlds.view_length, *settings.hidden)
        self.policy = Network((*sizes, worlds.actions), self._rng, last_scale=0.01)
        self.critic = Network((*sizes, 1), self._rng, last_scale=1.0)
        self.normalisation = Normalisation(worlds.view_length)
        # Separate optimisers, so that the norm of one gradient does not limit the other.
        self._policy_adam = Adam(self.policy.parameters(), settings.max_norm)
        self._critic_adam = Adam(self.critic.parameters(), settings.max_norm)
        self._views = self.normalisation(worlds.reset(seed))
        # Initialises the normalisation: without it the first round's inputs would saturate the network.
        self._rollout(np.float32(np.exp(settings.first_log_deviation)))

    def round(self, progress: float) -> None:
        """Runs `steps_per_round` steps in every world and learns from them; `progress` goes from 0 to 1."""
        settings = self.settings
        log_deviation = (1.0 - progress) * settings.first_log_deviation + progress * settings.last_log_deviation
        rollout = self._rollout(np.float32(np.exp(log_deviation)))
        advantages, returns = self._advantages(*rollout[2:])
        rate = settings.rate * (1.0 - progress)
        self._learn(rollout[0], rollout[1], advantages, returns, np.exp(log_deviation), rate)

    def _rollout(self, deviation: np.float32) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        steps, worlds = self.settings.steps_per_round, self._worlds.worlds
        views = np.empty((steps, worlds, self._worlds.view_length), np.float32)
        noises = np.empty((steps, worlds, self._worlds.actions), np.float32)
        rewards = np.empty((steps, worlds), np.float32)
        continues = np.empty((steps, worlds), np.float32)
        raws = []
        for step in range(steps):
            views[step] = self._views
            noises[step] = self._rng.standard_normal(noises.shape[1:], np.float32)
            raw, reward, ended = self._worlds.step(self.policy(self._views) + deviation * noises[step])
            raws.append(raw)
            rewards[step] = reward
            continues[step] = ~ended
            self._views = self.normalisation(raw)
        self.normalisation.update(np.concatenate(raws))
        flat = np.concatenate([views.reshape(-1, views.shape[-1]), self._views])
        values = self.critic(flat).reshape(steps + 1, worlds)
        return views, noises, rewards, continues, values

    def _advantages(self, rewards: Floats, continues: Floats, values: Floats) -> tuple[Floats, Floats]:
        settings = self.settings
        advantages = np.empty_like(rewards)
        following = np.zeros(rewards.shape[1], np.float32)
        for step in reversed(range(len(rewards))):
            error = rewards[step] + settings.discount * continues[step] * values[step + 1] - values[step]
            following = error + settings.discount * settings.trace * continues[step] * following
            advantages[step] = following
        return advantages, advantages + values[:-1]

    def _learn(
        self, views: Floats, noises: Floats, advantages: Floats, returns: Floats, deviation: float, rate: float
    ) -> None:
        settings = self.settings
        views = views.reshape(-1, views.shape[-1])
        noises = noises.reshape(-1, noises.shape[-1])
        actions = self.policy(views) + np.float32(deviation) * noises
        before = -0.5 * (noises**2).sum(axis=1)
        advantages, returns = advantages.reshape(-1), returns.reshape(-1)
        for _ in range(settings.epochs):
            permutation = self._rng.permutation(len(views))
            for first in range(0, len(permutation), settings.minibatch):
                batch = permutation[first : first + settings.minibatch]
                gain = advantages[batch]
                gain = (gain - gain.mean()) / (gain.std() + 1e-8)
                layers = self.policy.layers(views[batch])
                offset = (actions[batch] - layers[-1]) / np.float32(deviation)
                ratio = np.exp(-0.5 * (offset**2).sum(axis=1) - before[batch])
                # Where the clipped objective is the smaller one, it has no gradient.
                is_clipped = np.where(gain > 0.0, ratio > 1.0 + settings.clip, ratio < 1.0 - settings.clip)
                pull = np.where(is_clipped, 0.0, gain * ratio) / len(batch)
                slope = -(pull[:, None] * offset / np.float32(deviation)).astype(np.float32)
                policy = self.policy.gradients(layers, slope)
                layers = self.critic.layers(views[batch])
                error = (layers[-1][:, 0] - returns[batch]) / len(batch)
                critic = self.critic.gradients(layers, error[:, None].astype(np.float32))
                self._policy_adam.step(policy, rate)
                self._critic_adam.step(critic, rate)
