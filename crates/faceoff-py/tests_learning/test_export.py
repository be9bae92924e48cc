"""Exported policies of Stable-Baselines3, CleanRL and PyTorch act like the policies themselves, in the real evaluator, too."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import faceoff
import faceoff.gym
import faceoff.sb3
import gymnasium
import numpy as np
import onnxruntime
import pytest
import torch
from faceoff.gym import AirHockeyEnv, AirHockeyVectorEnv, MalletPlane
from gymnasium import wrappers
from policies import Policy, played, sb3_action
from stable_baselines3 import A2C, DDPG, DQN, PPO, SAC, TD3
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecFrameStack, VecMonitor, VecNormalize
from torch import nn

MALLET_SPEED_M_S = 1.5


def graph_of(folder: Path) -> Callable[[Any], Any]:
    """The policy of a bundle: (length,) to (length,)."""
    session = onnxruntime.InferenceSession(folder / "policy.onnx", providers=["CPUExecutionProvider"])
    return lambda observation: session.run(["action"], {"observation": np.asarray(observation, np.float32)[None]})[0][0]


def seen_observations(task: str, count: int = 200) -> Any:
    """(count, length): observations of an arm that moves at random."""
    env = AirHockeyEnv(task, profile="evaluation")  # type: ignore[arg-type]
    draws = np.random.default_rng(5)
    rows = [env.reset(seed=7)[0]]
    while len(rows) < count:
        observation, _, terminated, truncated, _ = env.step(draws.uniform(-0.3, 0.3, 7))
        rows.append(env.reset()[0] if terminated or truncated else observation)
    return np.array(rows)


def assert_same_score(folder: Path, policy: Policy, task: str, scratch: Path, **arguments: Any) -> None:
    """The agent's process plays like the policy in this process, on 20 episodes.

    With the exported graph the score is the same. PyTorch rounds differently, which a bounce of the puck may amplify.
    """
    got = played(folder, task, 20, scratch)
    graph = Policy(graph_of(folder), policy.mallet_speed_m_s, policy.frame_count)
    of_graph, of_policy = (
        faceoff.evaluate(player, tasks=task, episodes=20, **arguments)["tasks"][task] for player in (graph, policy)
    )
    for result in (got, of_graph):
        result["violations"].pop("computation_time", None)
    for name in ("successes", "steps", "violations"):
        assert got[name] == of_graph[name], name
    assert abs(got["successes"] - of_policy["successes"]) <= 2


@pytest.mark.parametrize("algorithm", [PPO, A2C, SAC, TD3, DDPG])
def test_algorithm_acts_like_its_predict(algorithm: Any, tmp_path: Path) -> None:
    envs = VecNormalize(VecMonitor(faceoff.sb3.make_vec_env("defend", 4, seed=0, clip_actions=True)), clip_obs=5.0)
    short = {"n_steps": 64} if algorithm in (PPO, A2C) else {"learning_starts": 100, "policy_kwargs": {"net_arch": [32]}}
    model = algorithm("MlpPolicy", envs, seed=0, device="cpu", **short)
    model.learn(512)
    folder = faceoff.export(model, tmp_path / "agent")
    exported, act = graph_of(folder), sb3_action(model)
    observations = seen_observations("defend")
    actions = np.array([act(observation) for observation in observations])
    assert np.ptp(actions, axis=0).max() > 0.0
    np.testing.assert_allclose([exported(observation) for observation in observations], actions, atol=1e-5)
    assert_same_score(folder, Policy(act), "defend", tmp_path, clip_actions=True)


def test_mallet_policy_scores_like_its_predict(tmp_path: Path) -> None:
    """The worlds of the page, and the same wrapper around a single environment of Gymnasium."""
    envs = faceoff.sb3.make_vec_env("defend", 8, seed=0, mallet_speed_m_s=MALLET_SPEED_M_S)
    model = PPO("MlpPolicy", VecNormalize(envs), n_steps=64, seed=0, device="cpu")
    model.learn(2048)
    folder = faceoff.export(model, tmp_path / "agent")
    raw = {"interpolation": 3, "action_mode": "raw"}
    assert_same_score(folder, Policy(sb3_action(model), MALLET_SPEED_M_S), "defend", tmp_path, **raw)
    single = DummyVecEnv([lambda: Monitor(MalletPlane(AirHockeyEnv("defend", **raw), MALLET_SPEED_M_S))])  # type: ignore[arg-type]
    normalised = VecNormalize(single)
    normalised.obs_rms = model.get_env().obs_rms
    other = faceoff.export(model, tmp_path / "other", env=normalised)
    assert (other / "policy.onnx").read_bytes() == (folder / "policy.onnx").read_bytes()
    assert (other / "agent.py").read_bytes() == (folder / "agent.py").read_bytes()


def test_stacked_observations_are_kept_by_the_agent(tmp_path: Path) -> None:
    envs = VecNormalize(VecFrameStack(faceoff.sb3.make_vec_env("defend", 4, seed=0, clip_actions=True), 3))
    model = PPO("MlpPolicy", envs, n_steps=64, seed=0, device="cpu")
    model.learn(512)
    folder = faceoff.export(model, tmp_path / "agent")
    assert_same_score(folder, Policy(sb3_action(model), frames=3), "defend", tmp_path, clip_actions=True)


def test_algorithm_scales_actions_to_the_raw_space(tmp_path: Path) -> None:
    """A squashed action becomes rad within the joints' limits."""
    env = gymnasium.make("faceoff/AirHockey-Prepare-v0", action_mode="raw", interpolation=2)
    model = SAC("MlpPolicy", env, policy_kwargs={"net_arch": [16]}, seed=1, device="cpu")
    exported, act = graph_of(faceoff.export(model, tmp_path / "agent")), sb3_action(model)
    for observation in seen_observations("prepare", 50):
        np.testing.assert_allclose(exported(observation), act(observation), atol=1e-5)


def test_loaded_model_needs_an_environment(tmp_path: Path) -> None:
    envs = VecNormalize(faceoff.sb3.make_vec_env("hit", 2, seed=0, clip_actions=True))
    model = PPO("MlpPolicy", envs, n_steps=32, batch_size=64, seed=0, device="cpu")
    model.learn(64)
    model.save(tmp_path / "model.zip")
    envs.save(str(tmp_path / "normalisation.pkl"))
    loaded = PPO.load(tmp_path / "model.zip", device="cpu")
    with pytest.raises(faceoff.ArgumentError, match="env: expected the environment of the training, since this PPO has none"):
        faceoff.export(loaded, tmp_path / "agent")
    again = VecNormalize.load(str(tmp_path / "normalisation.pkl"), faceoff.sb3.make_vec_env("hit", 1, clip_actions=True))
    first = faceoff.export(model, tmp_path / "first")
    second = faceoff.export(loaded, tmp_path / "second", env=again)
    third = faceoff.export(loaded.policy, tmp_path / "third", env=again)
    expected = (first / "policy.onnx").read_bytes()
    assert (second / "policy.onnx").read_bytes() == expected
    assert (third / "policy.onnx").read_bytes() == expected


class Recurrent(nn.Module):
    def __init__(self) -> None:
        super().__init__()
        self.layer = nn.Linear(20, 7)
        self.last = torch.zeros(1, 7)

    def forward(self, observation: Any) -> Any:
        self.last = torch.tanh(self.layer(0.01 * observation) + self.last)
        return self.last


class Returning(nn.Module):
    def __init__(self, output: Any) -> None:
        super().__init__()
        self.output = output

    def forward(self, observation: Any) -> Any:
        return self.output


def stacked_normalised() -> Any:
    return PPO("MlpPolicy", VecFrameStack(VecNormalize(faceoff.sb3.make_vec_env("defend", 2)), 4), device="cpu")


def in_processes() -> Any:
    return SubprocVecEnv([AirHockeyEnv])


REFUSED: list[tuple[Callable[[], dict[str, Any]], str]] = [
    (lambda: {"policy": stacked_normalised()}, "env: expected no VecNormalize below VecFrameStack: put it above"),
    (lambda: {"policy": nn.Linear(23, 7), "task": "defend"}, r"expected a module that accepts observations of shape \(1, 20\)"),
    (lambda: {"policy": nn.Linear(20, 7)}, "env: expected the environment of the training, or task="),
    (lambda: {"policy": nn.Linear(20, 6), "env": AirHockeyEnv(clip_actions=True)}, r"expected actions of shape \(200, 7\)"),
    (lambda: {"policy": nn.Linear(20, 6), "env": wrappers.ClipAction(AirHockeyEnv())}, r"expected actions of shape \(200, 7\)"),
    (lambda: {"policy": nn.Linear(20, 7), "task": "defend"}, "expected actions from -1 to 1, which env accepts"),
    (lambda: {"policy": Returning((1, 2)), "task": "defend"}, r"expected a module that returns a tensor .* got tuple"),
    (lambda: {"policy": Returning(torch.zeros(7)), "task": "defend"}, r"returns a tensor .* got shape \(7,\)"),
    (lambda: {"policy": Recurrent(), "task": "defend"}, "policy: expected"),
    (lambda: {"policy": nn.Module(), "task": "defend"}, "expected a module that accepts observations"),
]


@pytest.mark.parametrize(("make", "message"), REFUSED)
def test_invalid_modules_and_environments_are_refused(make: Any, message: str, tmp_path: Path) -> None:
    arguments = make()
    with pytest.raises(faceoff.Error, match=message):
        faceoff.export(arguments.pop("policy"), tmp_path / "agent", **arguments)
    assert list(tmp_path.iterdir()) == []


def test_mallet_speed_of_worlds_is_checked() -> None:
    with pytest.raises(faceoff.ArgumentTypeError, match="max_speed_m_s: expected a number above 0 and up to 5, got 'fast'"):
        faceoff.sb3.make_vec_env("defend", 2, mallet_speed_m_s="fast")  # type: ignore[arg-type]
    with pytest.raises(faceoff.ArgumentError, match="env: expected one made with action_mode='raw' and interpolation=3"):
        faceoff.sb3.make_vec_env("defend", 2, mallet_speed_m_s=1.0, action_mode="delta")


def test_worlds_in_other_processes_are_refused(tmp_path: Path) -> None:
    envs = in_processes()
    try:
        with pytest.raises(faceoff.ArgumentError, match="got a SubprocVecEnv: pass env=, one such environment"):
            faceoff.export(nn.Linear(20, 7), tmp_path / "agent", env=envs)
    finally:
        envs.close()


def test_discrete_actions_are_refused(tmp_path: Path) -> None:
    model = DQN("MlpPolicy", "CartPole-v1", device="cpu")
    with pytest.raises(faceoff.ArgumentError, match="policy: expected actions in a one-dimensional Box, got Discrete"):
        faceoff.export(model, tmp_path / "agent", task="defend", env=AirHockeyEnv())


class PpoAgent(nn.Module):
    """Has the parts of CleanRL's agent for PPO with continuous actions, and no forward."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.critic = nn.Sequential(nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 1))
        self.actor_mean = nn.Sequential(nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, outputs))
        self.actor_logstd = nn.Parameter(torch.zeros(1, outputs))

    def mean(self, observation: Any) -> Any:
        return self.actor_mean(observation)


class SacActor(nn.Module):
    """Has the methods of CleanRL's actor for SAC: `forward` gives mean and deviation before squashing."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.body = nn.Sequential(nn.Linear(inputs, 64), nn.ReLU())
        self.fc_mean, self.fc_logstd = nn.Linear(64, outputs), nn.Linear(64, outputs)
        self.register_buffer("action_scale", torch.full((outputs,), 0.8))
        self.register_buffer("action_bias", torch.full((outputs,), 0.1))

    def forward(self, observation: Any) -> Any:
        features = self.body(observation)
        return self.fc_mean(features), torch.tanh(self.fc_logstd(features))

    def get_action(self, observation: Any) -> Any:
        mean, log_std = self(observation)
        action = torch.tanh(mean + log_std.exp() * torch.randn_like(mean)) * self.action_scale + self.action_bias
        return action, None, torch.tanh(mean) * self.action_scale + self.action_bias

    def mean(self, observation: Any) -> Any:
        return self.get_action(observation)[2]


class Td3Actor(nn.Module):
    """Has the methods of CleanRL's actor for TD3 and DDPG."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.fc_mu = nn.Linear(inputs, outputs)
        self.register_buffer("action_scale", torch.full((outputs,), 0.9))
        self.register_buffer("action_bias", torch.full((outputs,), -0.1))

    def forward(self, observation: Any) -> Any:
        return torch.tanh(self.fc_mu(observation)) * self.action_scale + self.action_bias

    def mean(self, observation: Any) -> Any:
        return self(observation)


@pytest.mark.parametrize("kind", [PpoAgent, SacActor, Td3Actor])
def test_modules_of_cleanrl_act_by_their_mean(kind: Any, tmp_path: Path) -> None:
    torch.manual_seed(0)
    env: Any = wrappers.RecordEpisodeStatistics(gymnasium.make("faceoff/AirHockey-Prepare-v0"))
    env = wrappers.NormalizeObservation(wrappers.ClipAction(env))
    env.reset(seed=0)
    for _ in range(50):
        env.step(env.action_space.sample())
    agent = kind(20, 7)
    folder = faceoff.export(agent, tmp_path / "agent", env=env)
    env.update_running_mean = False

    def act(observation: Any) -> Any:
        with torch.no_grad():
            return env.env.action(agent.mean(torch.as_tensor(env.observation(observation))[None])[0].numpy())

    exported = graph_of(folder)
    for observation in seen_observations("prepare", 50):
        np.testing.assert_allclose(exported(observation), act(observation), atol=1e-5)
    assert_same_score(folder, Policy(act), "prepare", tmp_path)


def test_module_keeps_its_training_mode(tmp_path: Path) -> None:
    module = nn.Sequential(nn.Linear(23, 16), nn.BatchNorm1d(16), nn.Dropout(0.5), nn.Linear(16, 14), nn.Tanh())
    module[1].eval()
    env = AirHockeyVectorEnv(2, "hit", interpolation=4, action_mode="absolute")
    exported = graph_of(faceoff.export(module, tmp_path / "agent", env=env))
    assert module.training and module[2].training and not module[1].training
    module.eval()
    with torch.no_grad():
        for observation in seen_observations("hit", 20):
            expected = module(torch.as_tensor(observation)[None])[0].numpy()
            np.testing.assert_allclose(exported(observation), expected, atol=1e-5)
