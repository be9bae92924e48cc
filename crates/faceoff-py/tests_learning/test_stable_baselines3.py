"""Stable-Baselines3 itself accepts the environments and learns in them."""

from __future__ import annotations

import warnings

import faceoff.sb3
import numpy as np
import pytest
from faceoff.gym import AirHockeyEnv, MalletPlane
from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize


@pytest.mark.parametrize("task", ["hit", "defend", "prepare"])
def test_checker_passes(task: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(AirHockeyEnv(task, profile="evaluation"), skip_render_check=True)  # type: ignore[arg-type]


def test_checker_passes_with_mallet_actions() -> None:
    env = MalletPlane(AirHockeyEnv("defend", action_mode="raw", interpolation=3))
    check_env(env, skip_render_check=True)


def test_ppo_learns_in_the_vector_environment() -> None:
    envs = faceoff.sb3.make_vec_env("defend", 16, profile="evaluation", clip_actions=True)
    assert isinstance(envs, VecEnv)
    monitored = VecMonitor(envs)
    learner = PPO("MlpPolicy", VecNormalize(monitored), n_steps=128, batch_size=256, n_epochs=2, seed=0, device="cpu")
    before = [parameter.detach().numpy().copy() for parameter in learner.policy.parameters()]
    learner.learn(8192)
    after = [parameter.detach().numpy() for parameter in learner.policy.parameters()]
    assert any(not np.array_equal(one, other) for one, other in zip(before, after))
    # The buffer is filled only if infos have `terminal_observation` and `episode`.
    assert len(learner.ep_info_buffer) > 0
    rewards, lengths = evaluate_policy(learner, monitored, n_eval_episodes=8, return_episode_rewards=True)
    assert len(rewards) == len(lengths) == 8
    assert all(0 < length <= 500 for length in lengths)
    learner.env.close()
