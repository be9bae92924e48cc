"""RLlib's and TorchRL's adapters for Gymnasium take the environments."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

#: Gymnasium imports the module before the colon, also in processes of these libraries.
IDENTIFIER = "faceoff.gym:faceoff/AirHockey-Defend-v0"


def make_torchrl_env() -> object:
    from torchrl.envs import GymEnv

    return GymEnv(IDENTIFIER, profile="evaluation")


def test_torchrl_checks_and_rolls_out_one_world() -> None:
    from torchrl.envs.utils import check_env_specs

    env = make_torchrl_env()
    check_env_specs(env)  # type: ignore[arg-type]
    rollout = env.rollout(600, break_when_any_done=False)  # type: ignore[attr-defined]
    assert rollout.batch_size == (600,)
    assert rollout["next", "done"].sum() >= 1


def test_torchrl_takes_the_vector_environment() -> None:
    from torchrl.envs import GymWrapper

    # It refuses NextStep, and expects infos of each step to have the same keys, which those of SameStep do not.
    envs = GymWrapper(gymnasium.make_vec(IDENTIFIER, num_envs=4, autoreset_mode="Disabled"))
    rollout = envs.rollout(600, break_when_any_done=False)
    assert rollout.batch_size == (4, 600)
    assert rollout["next", "done"].sum() >= 4


def test_torchrl_steps_environments_in_processes() -> None:
    from torchrl.envs import ParallelEnv

    envs = ParallelEnv(2, make_torchrl_env)
    assert envs.rollout(5).batch_size == (2, 5)
    envs.close()


def test_rllib_trains_in_its_own_processes(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    import ray
    from ray.rllib.algorithms.ppo import PPOConfig

    monkeypatch.setenv("RAY_AUTH_MODE", "disabled")
    # The paths of its sockets may not be long.
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, _temp_dir=str(tmp_path_factory.mktemp("r")))
    try:
        settings = {"profile": "evaluation", "clip_actions": True}
        config = PPOConfig().environment(IDENTIFIER, env_config=settings)
        config = config.env_runners(num_env_runners=1, num_envs_per_env_runner=4)
        config = config.training(train_batch_size_per_learner=1_000, minibatch_size=250, num_epochs=1)
        learner = config.build_algo()
        result = learner.train()["env_runners"]
        assert result["num_env_steps_sampled"] >= 1_000
        assert result["num_episodes"] >= 1
        assert np.isfinite(result["episode_return_mean"])
        learner.stop()
    finally:
        ray.shutdown()
