"""Policies of Stable-Baselines3, and its vector environments."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.spaces import Box

from faceoff._export.environment import CURE, SUBPROCESSES, Layer, is_transparent
from faceoff._export.network import PolicyNetwork
from faceoff._export.steps import Array, clip, normalise, unscale
from faceoff._export.torch_modules import trace
from faceoff.errors import ArgumentError
from faceoff.sb3 import VecEnvMethods


def is_policy(policy: object) -> bool:
    """Whether it is an algorithm or a policy of Stable-Baselines3, which is imported."""
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.policies import BasePolicy

    return isinstance(policy, (BaseAlgorithm, BasePolicy))


def environment_of(algorithm: Any) -> Any:
    """The environment in which it was trained.

    Raises:
        ArgumentError: if it has none: it was loaded without one, or it is only a policy.
    """
    env = algorithm.get_env() if hasattr(algorithm, "get_env") else None
    if env is None:
        raise ArgumentError(
            f"env: expected the environment of the training, since this {type(algorithm).__name__} has none, got None: "
            "load the model with env=, or pass env=, with the VecNormalize of the training if there was one"
        )
    return env


def read_network(algorithm: Any, observation_len: int) -> PolicyNetwork:
    """The network whose output is the deterministic action of `predict`.

    Raises:
        ArgumentError: if the policy is recurrent, or has other spaces than one vector of numbers each.
    """
    policy = getattr(algorithm, "policy", algorithm)
    for name, space in (("observations", policy.observation_space), ("actions", policy.action_space)):
        if not isinstance(space, Box) or len(space.shape) != 1:
            raise ArgumentError(f"policy: expected {name} in a one-dimensional Box, got {space!r:.80}")
    if any("lstm" in name for name, _ in policy.named_modules()):
        raise ArgumentError(
            "policy: expected one whose actions depend on the observation alone, got a recurrent policy: write an "
            "agent that keeps its state (faceoff.agent)"
        )
    import torch

    class Deterministic(torch.nn.Module):  # type: ignore[misc]
        """The action before it is clipped or scaled to the action space."""

        def __init__(self) -> None:
            super().__init__()
            self.policy = policy

        def forward(self, observation: Any) -> Any:
            return self.policy._predict(observation, deterministic=True)

    def predict(observations: Array) -> Array:
        actions: Array = policy.predict(observations, deterministic=True)[0]
        return actions

    low, high = policy.action_space.low, policy.action_space.high
    steps = unscale(low, high) if policy.squash_output else clip(low, high)
    return PolicyNetwork(trace(Deterministic(), observation_len), predict, steps)


def read_vec_env_layer(env: Any) -> Layer | None:
    """What a vector environment of Stable-Baselines3 does; None for another object, and for Faceoff's own."""
    from stable_baselines3.common.vec_env import (
        DummyVecEnv,
        SubprocVecEnv,
        VecEnv,
        VecEnvWrapper,
        VecFrameStack,
        VecNormalize,
    )

    if isinstance(env, VecEnvMethods) or not isinstance(env, VecEnv):
        return None
    if isinstance(env, VecNormalize):
        if not env.norm_obs:
            return Layer(env.venv)
        rms: Any = env.obs_rms
        if not isinstance(getattr(rms, "mean", None), np.ndarray):
            raise ArgumentError(f"env: expected VecNormalize with statistics of one array, got {rms!r:.80}")
        return Layer(env.venv, normalise(rms.mean, rms.var, env.epsilon, env.clip_obs))
    if isinstance(env, VecFrameStack):
        stacked: Any = env.stacked_obs
        return Layer(env.venv, frames=int(stacked.n_stack))
    if isinstance(env, DummyVecEnv):
        return Layer(env.envs[0])
    if isinstance(env, SubprocVecEnv):
        raise ArgumentError(f"env: expected worlds in this process, got a SubprocVecEnv: {SUBPROCESSES}")
    if isinstance(env, VecEnvWrapper) and is_transparent(env):
        return Layer(env.venv)
    raise ArgumentError(f"env: expected wrappers that can be exported, got {type(env).__name__}: {CURE}")
