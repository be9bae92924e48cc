"""Learns to defend with Stable-Baselines3's PPO in 20 minutes on two cores, and makes an agent of the policy.

    python agents/examples/sb3_defend.py my-defender

writes the model (`my-defender.zip`) and the agent's folder (`my-defender`). docs/from-sb3.md explains each part.
"""

from __future__ import annotations

import argparse
import os
import time
from typing import Any

# The environment has its own threads; threads of linear algebra on small arrays would only compete with them.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import faceoff
import faceoff.sb3
import numpy as np
import numpy.typing as npt
import torch
from faceoff.gym import Transition
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import VecFrameStack, VecNormalize

#: Mallet speed of an action of 1, m/s.
MALLET_SPEED_M_S = 1.5
#: Observations that the policy gets: the camera loses the puck for 5 to 20 steps.
FRAMES = 16
STEP_S = 0.02
#: |y| of a puck's centre at a long rim, m.
RIM_Y_M = 0.487
#: The table's centre in the robot's base frame, m.
TABLE_CENTRE_M = (1.51, 0.0)


def reward(transition: Transition) -> npt.NDArray[np.float64]:
    """1 for a success, plus a tenth of the speed (m/s) lost by the puck, minus a cost for a mallet beside its path."""
    before, after = transition.state.puck, transition.next_state.puck
    lost_speed_m_s = np.linalg.norm(before[:, 3:5], axis=1) - np.linalg.norm(after[:, 3:5], axis=1)
    mallet = transition.next_state.mallet[:, :2] - TABLE_CENTRE_M
    is_coming = (after[:, 3] < 0.0) & (after[:, 0] > mallet[:, 0])
    distance_m = np.where(is_coming, np.abs(after[:, 1] - mallet[:, 1]), 0.0)
    rewards: npt.NDArray[np.float64] = 1.0 * transition.success + 0.1 * lost_speed_m_s - 0.05 * distance_m
    return rewards


class Tracker(BaseFeaturesExtractor):  # type: ignore[misc]
    """Estimates puck and mallet from the last observations: (n, 20 × FRAMES) to (n, 15).

    All of it is torch, so the exported network contains it.
    """

    def __init__(self, observation_space: Any) -> None:
        super().__init__(observation_space, 15)
        # Steps since each observation; means and standard deviations of the features with random actions.
        self.register_buffer("age", torch.arange(FRAMES - 1, -1, -1).float()[:, None])
        mean = [1.05, 0.0, -0.27, 0.0, 0.72, 0.0, 0.05, 0.0, 0.32, 0.0, 0.55, 0.78, 0.86, 0.0, 1.03]
        deviation = [0.38, 0.28, 0.91, 0.32, 0.11, 0.15, 0.3, 0.26, 0.41, 0.33, 0.29, 0.63, 0.65, 0.34, 0.55]
        self.register_buffer("mean", torch.tensor(mean))
        self.register_buffer("deviation", torch.tensor(deviation))

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Weighted means of what was seen, and the puck's arrival at the mallet."""
        frames = observations.view(-1, FRAMES, 20)
        puck, speed, q = frames[:, :, :2], frames[:, :, 3:5], frames[:, -2:, 6:13]
        # A lost puck is reported at its last position, at rest. So are the zeros before an episode.
        seen = (speed != 0.0).any(2, keepdim=True).float()
        weight, recent = seen * 0.65**self.age, seen * 0.3**self.age
        velocity = (weight * speed).sum(1) / (weight.sum(1) + 1e-9)
        now = puck + velocity[:, None] * STEP_S * self.age
        position = (recent * now).sum(1) / (recent.sum(1) + 1e-9)
        mallet = mallet_position(q)
        mallet_velocity = ((mallet[:, -1] - mallet[:, -2]) / STEP_S).clamp(-2.0, 2.0)
        offset = position - mallet[:, -1]
        arrival_s = (offset[:, :1] / (-velocity[:, :1]).clamp(min=1e-3)).clamp(0.0, 1.5)
        y = position[:, 1:] + arrival_s * velocity[:, 1:]
        y = torch.where(y.abs() > RIM_Y_M, y.sign() * (2.0 * RIM_Y_M - y.abs()), y)
        features = [position, velocity, mallet[:, -1], mallet_velocity, offset, offset.norm(dim=1, keepdim=True)]
        features += [velocity.norm(dim=1, keepdim=True), arrival_s, y - mallet[:, -1, 1:], 0.5 * weight.sum(1).clamp(max=3.0)]
        return ((torch.cat(features, 1) - self.mean) / self.deviation).clamp(-10.0, 10.0)


def mallet_position(q: torch.Tensor) -> torch.Tensor:
    """x, y (..., 2), m, from joint positions (..., 7), rad, in the postures of `MalletPlane`: joints 3, 5 and 7 at zero."""
    upper, forearm = q[..., 1], q[..., 1] - q[..., 3]
    reach = 0.42 * upper.sin() + 0.4 * forearm.sin() + 0.666 * (forearm + q[..., 5]).sin()
    return torch.stack([reach * q[..., 0].cos(), reach * q[..., 0].sin()], -1)


def make_worlds(count: int, seed: int) -> VecNormalize:
    """Worlds of `defend` with the perturbations of evaluations; each world has another robot."""
    envs = faceoff.sb3.make_vec_env(
        "defend", count, seed=seed, profile="evaluation", mallet_speed_m_s=MALLET_SPEED_M_S, reward=reward
    )
    # The features have their own normalisation; that of rewards is for the value function.
    return VecNormalize(VecFrameStack(envs, FRAMES), norm_obs=False)


class Progress(BaseCallback):  # type: ignore[misc]
    """Reduces the noise of actions in the course of the training, and prints the success rate with it."""

    def _on_training_start(self) -> None:
        self.started_s = time.monotonic()
        self.successes: list[bool] = []
        # The noise follows a schedule. If it is learned, it shrinks before the policy has found out how to catch a puck.
        self.model.policy.log_std.requires_grad_(False)

    def _on_rollout_start(self) -> None:
        remaining = self.model._current_progress_remaining
        self.model.policy.log_std.data.fill_(-0.7 * remaining - 1.8 * (1.0 - remaining))

    def _on_step(self) -> bool:
        self.successes += [info["is_success"] for info in self.locals["infos"] if "is_success" in info]
        return True

    def _on_rollout_end(self) -> None:
        if self.n_calls % (64 * 30) == 0:
            elapsed_s, share = time.monotonic() - self.started_s, np.mean(self.successes)
            print(f"{elapsed_s:5.0f} s {self.num_timesteps:>10,} steps, {100.0 * share:.1f} % succeeded", flush=True)
            self.successes.clear()


def success_rate(model: PPO, episodes: int) -> float:
    """The share of successes in the episodes of `faceoff eval --seed 0`, by Stable-Baselines3."""
    envs = make_worlds(1, seed=0)
    envs.training = False
    observation = envs.reset()
    successes: list[bool] = []
    while len(successes) < episodes:
        action, _ = model.predict(observation, deterministic=True)
        observation, _, dones, infos = envs.step(action)
        successes += [info["is_success"] for info, done in zip(infos, dones, strict=True) if done]
    envs.close()
    return float(np.mean(successes))


def main() -> None:
    """Trains, evaluates and exports."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", help="folder of the agent to create")
    parser.add_argument("--steps", type=int, default=8_000_000, help="control steps to learn from (8,000,000)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the network and its exploration (1)")
    parser.add_argument("--episodes", type=int, default=400, help="episodes of the evaluation (400)")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    model = PPO(
        "MlpPolicy",
        make_worlds(256, seed=1000),
        n_steps=64,
        batch_size=4096,
        n_epochs=5,
        learning_rate=lambda remaining: 1e-3 * remaining,
        max_grad_norm=1.0,
        policy_kwargs={"features_extractor_class": Tracker, "net_arch": [64, 64]},
        seed=arguments.seed,
        device="cpu",
    )
    model.learn(arguments.steps, callback=Progress())
    model.save(arguments.folder)
    print(f"success rate {success_rate(model, arguments.episodes):.4f} of {arguments.episodes} episodes")
    print(f"exported to {faceoff.export(model, arguments.folder)}")


if __name__ == "__main__":
    main()
