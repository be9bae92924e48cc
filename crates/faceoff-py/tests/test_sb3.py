"""The vector environment's methods for Stable-Baselines3, tested without that package, which needs torch."""

import numpy as np
import pytest

import faceoff
from faceoff.gym import AirHockeyEnv, AirHockeyVectorEnv, MalletPlane, MalletPlaneVector
from faceoff.sb3 import VecEnvMethods, make_vec_env


def make_worlds(worlds: int, **arguments: object) -> VecEnvMethods:
    return VecEnvMethods(AirHockeyVectorEnv(worlds, autoreset_mode="SameStep", **arguments))  # type: ignore[arg-type]


def test_spaces_are_those_of_one_world() -> None:
    envs = make_worlds(3, task="hit")
    assert envs.num_envs == 3
    assert envs.observation_space.shape == (23,)
    assert envs.action_space.shape == (7,)


def test_end_info_has_terminal_observation_and_truncation() -> None:
    envs = make_worlds(2, task="prepare", max_episode_steps=4)
    assert envs.seed(6) == [6, 7]
    envs.reset()
    assert envs.reset_infos[1]["seed"] == 7
    single = AirHockeyEnv("prepare", max_episode_steps=4)
    single.reset(seed=7)
    for step in range(4):
        envs.step_async(np.zeros((2, 7)))
        observations, rewards, dones, infos = envs.step_wait()
        final, reward, *_, truncated, info = single.step(np.zeros(7))
        assert rewards.dtype == np.float32
        assert rewards[1] == np.float32(reward)
        assert dones.tolist() == [truncated] * 2
        assert infos[1]["TimeLimit.truncated"] == truncated
    np.testing.assert_array_equal(infos[1]["terminal_observation"], final)
    assert infos[1]["is_success"] == info["success"]
    assert infos[1]["end"] == "horizon"
    assert envs.reset_infos[1]["episode_number"] == 1
    np.testing.assert_array_equal(observations[1], single.reset()[0])


def test_terminated_episode_is_not_truncated() -> None:
    envs = make_worlds(4, task="defend")
    envs.seed(0)
    envs.reset()
    terminated = 0
    while terminated < 4:
        envs.step_async(np.zeros((4, 7)))
        _, _, dones, infos = envs.step_wait()
        for done, info in zip(dones, infos, strict=True):
            assert ("terminal_observation" in info) == done
            if done and info["end"] != "horizon":
                assert info["TimeLimit.truncated"] is False
                terminated += 1


def test_attributes_and_methods_of_worlds() -> None:
    envs = make_worlds(3, task="hit", render_mode="rgb_array")
    envs.reset()
    assert envs.get_attr("task") == ["hit"] * 3
    assert envs.get_attr("render_mode", indices=1) == ["rgb_array"]
    assert envs.env_is_wrapped(object, indices=[0, 2]) == [False, False]
    assert len(envs.env_method("render", indices=[1])) == 1
    assert len(envs.get_images()) == 3
    for call in (lambda: envs.set_attr("task", "defend"), lambda: envs.env_method("save")):
        with pytest.raises(faceoff.ArgumentError):
            call()


def test_recorders_find_the_speed_of_videos() -> None:
    assert make_worlds(1).metadata["render_fps"] == 50


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"n_envs": 0}, "n_envs: expected a whole number from 1"),
        ({"profil": "ideal"}, "make_vec_env: expected arguments among .*, got profil"),
        ({"num_envs": 3}, "make_vec_env: expected arguments among .*, got num_envs"),
    ],
)
def test_errors_name_the_argument_of_the_caller(arguments: dict[str, int], message: str) -> None:
    with pytest.raises(faceoff.Error, match=message):
        make_vec_env(**arguments)  # type: ignore[arg-type]


def test_other_autoreset_modes_are_refused() -> None:
    with pytest.raises(faceoff.ArgumentTypeError, match="SameStep"):
        VecEnvMethods(AirHockeyVectorEnv(2))
    with pytest.raises(faceoff.ArgumentError, match="autoreset_mode"):
        make_vec_env("hit", 2, autoreset_mode="Disabled")


def test_worlds_with_mallet_actions_equal_the_wrapper() -> None:
    base = AirHockeyVectorEnv(3, autoreset_mode="SameStep", action_mode="raw", interpolation=3, max_episode_steps=5)
    envs = VecEnvMethods(MalletPlaneVector(base, 1.5))
    assert envs.action_space.shape == (2,)
    single = MalletPlane(AirHockeyEnv(action_mode="raw", interpolation=3, max_episode_steps=5), 1.5)
    envs.seed(3)
    envs.reset()
    single.reset(seed=4)
    draws = np.random.default_rng(0)
    for _ in range(12):
        actions = draws.uniform(-1.0, 1.0, (3, 2))
        envs.step_async(actions)
        observations, _, dones, _ = envs.step_wait()
        observation, *_ = single.step(actions[1])
        if dones[1]:
            observation, _ = single.reset()
        np.testing.assert_array_equal(observations[1], observation)
