"""Proximal policy optimisation (PPO, Schulman et al., 2017) in many worlds (simulated tables) in parallel, in NumPy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from network import Adam, Floats, Network, Normalisation

Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Settings:
    """Hyperparameters. Learning rate and action noise change linearly from the first round to the last."""

    #: Control steps per world in a round; then the policy learns from them.
    steps_per_round: int = 64
    #: Passes over the samples of a round.
    epochs: int = 5
    minibatch: int = 4096
    learning_rate: float = 7e-4
    discount: float = 0.99
    #: λ of generalised advantage estimation.
    gae_lambda: float = 0.95
    #: The ratio of new and old probability is clipped to 1 ± this.
    clip_range: float = 0.2
    #: Limit on the norm of a gradient.
    max_norm: float = 0.5
    #: Logarithm of the action noise's standard deviation, in the first and the last round.
    first_log_deviation: float = -0.7
    last_log_deviation: float = -2.3
    #: Sizes of the hidden layers.
    hidden: tuple[int, ...] = (64, 64)


class Worlds(Protocol):
    """Interface of the training environment."""

    worlds: int
    feature_count: int
    actions: int

    def reset(self, seed: int) -> npt.NDArray[np.floating]:
        """Begins an episode in each world; returns features (worlds, feature_count)."""

    def step(
        self, actions: Floats
    ) -> tuple[npt.NDArray[np.floating], npt.NDArray[np.floating], Bools]:
        """Features, rewards and whether the episode ended; after an end, features are those of the next episode."""


class Learner:
    """A policy, a critic, which estimates the value of a state, and their optimisers."""

    def __init__(self, worlds: Worlds, settings: Settings, seed: int) -> None:
        self.settings = settings
        self._worlds = worlds
        self._rng = np.random.default_rng(seed)
        sizes = (worlds.feature_count, *settings.hidden)
        self.policy = Network((*sizes, worlds.actions), self._rng, last_scale=0.01)
        self.critic = Network((*sizes, 1), self._rng, last_scale=1.0)
        self.normalisation = Normalisation(worlds.feature_count)
        # Separate optimisers, so that the norm of one gradient does not limit the other.
        self._policy_adam = Adam(self.policy.parameters(), settings.max_norm)
        self._critic_adam = Adam(self.critic.parameters(), settings.max_norm)
        self._inputs = self.normalisation(worlds.reset(seed))
        # Initialises the normalisation: without it the first round's inputs would saturate the network.
        self._rollout(np.float32(np.exp(settings.first_log_deviation)))

    def round(self, progress: float) -> None:
        """Runs `steps_per_round` steps in every world and learns from them; `progress` goes from 0 to 1."""
        settings = self.settings
        log_deviation = (1.0 - progress) * settings.first_log_deviation + progress * settings.last_log_deviation
        rollout = self._rollout(np.float32(np.exp(log_deviation)))
        advantages, returns = self._advantages(*rollout[2:])
        learning_rate = settings.learning_rate * (1.0 - progress)
        self._learn(rollout[0], rollout[1], advantages, returns, np.exp(log_deviation), learning_rate)

    # Inputs, noises, rewards, 1 where the episode goes on, and values (one step more), each (steps, worlds, …).
    def _rollout(self, deviation: np.float32) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        steps, worlds = self.settings.steps_per_round, self._worlds.worlds
        inputs = np.empty((steps, worlds, self._worlds.feature_count), np.float32)
        noises = np.empty((steps, worlds, self._worlds.actions), np.float32)
        rewards = np.empty((steps, worlds), np.float32)
        continues = np.empty((steps, worlds), np.float32)
        all_features = []
        for step in range(steps):
            inputs[step] = self._inputs
            noises[step] = self._rng.standard_normal(noises.shape[1:], np.float32)
            features, reward, ended = self._worlds.step(self.policy(self._inputs) + deviation * noises[step])
            all_features.append(features)
            rewards[step] = reward
            continues[step] = ~ended
            self._inputs = self.normalisation(features)
        self.normalisation.update(np.concatenate(all_features))
        all_inputs = np.concatenate([inputs.reshape(-1, inputs.shape[-1]), self._inputs])
        values = self.critic(all_inputs).reshape(steps + 1, worlds)
        return inputs, noises, rewards, continues, values

    # Advantages and returns by generalised advantage estimation.
    def _advantages(self, rewards: Floats, continues: Floats, values: Floats) -> tuple[Floats, Floats]:
        settings = self.settings
        advantages = np.empty_like(rewards)
        advantage = np.zeros(rewards.shape[1], np.float32)
        for step in reversed(range(len(rewards))):
            error = rewards[step] + settings.discount * continues[step] * values[step + 1] - values[step]
            advantage = error + settings.discount * settings.gae_lambda * continues[step] * advantage
            advantages[step] = advantage
        return advantages, advantages + values[:-1]

    # Improves policy and critic with the samples of a round.
    def _learn(
        self,
        inputs: Floats,
        noises: Floats,
        advantages: Floats,
        returns: Floats,
        deviation: float,
        learning_rate: float,
    ) -> None:
        settings = self.settings
        inputs = inputs.reshape(-1, inputs.shape[-1])
        noises = noises.reshape(-1, noises.shape[-1])
        actions = self.policy(inputs) + np.float32(deviation) * noises
        old_log_density = -0.5 * (noises**2).sum(axis=1)
        advantages, returns = advantages.reshape(-1), returns.reshape(-1)
        for _ in range(settings.epochs):
            permutation = self._rng.permutation(len(inputs))
            for start in range(0, len(permutation), settings.minibatch):
                batch = permutation[start : start + settings.minibatch]
                batch_advantages = advantages[batch]
                batch_advantages = (batch_advantages - batch_advantages.mean()) / (batch_advantages.std() + 1e-8)
                layers = self.policy.layers(inputs[batch])
                normalised_noise = (actions[batch] - layers[-1]) / np.float32(deviation)
                ratio = np.exp(-0.5 * (normalised_noise**2).sum(axis=1) - old_log_density[batch])
                # Where the clipped objective is the smaller one, it has no gradient.
                is_clipped = np.where(
                    batch_advantages > 0.0, ratio > 1.0 + settings.clip_range, ratio < 1.0 - settings.clip_range
                )
                weight = np.where(is_clipped, 0.0, batch_advantages * ratio) / len(batch)
                policy_gradient = -(weight[:, None] * normalised_noise / np.float32(deviation)).astype(np.float32)
                policy_gradients = self.policy.gradients(layers, policy_gradient)
                layers = self.critic.layers(inputs[batch])
                error = (layers[-1][:, 0] - returns[batch]) / len(batch)
                critic_gradients = self.critic.gradients(layers, error[:, None].astype(np.float32))
                self._policy_adam.step(policy_gradients, learning_rate)
                self._critic_adam.step(critic_gradients, learning_rate)
