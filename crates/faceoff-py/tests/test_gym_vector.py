"""Many worlds: each equals the single environment, in all modes and with any number of threads."""

import pickle
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics

import faceoff.gym
from faceoff.gym import AirHockeyEnv, AirHockeyVectorEnv, Transition

WORLDS = 6


def actions_of(envs: Any, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, envs.action_space.shape).astype(np.float32)


def assert_same_infos(first: dict[str, Any], second: dict[str, Any]) -> None:
    """Compares infos where their mask is set; other values are unspecified."""
    assert set(first) == set(second)
    for name, values in first.items():
        if name.startswith("_"):
            np.testing.assert_array_equal(values, second[name], err_msg=name)
        elif isinstance(values, dict):
            assert_same_infos(values, second[name])
        else:
            mask = first[f"_{name}"]
            for actual, expected in zip(values[mask], second[name][mask], strict=True):
                np.testing.assert_array_equal(actual, expected, err_msg=name)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("task", ["hit", "defend"])
def test_worlds_equal_the_single_environment_bit_for_bit(
    mode: AutoresetMode, threads: int, task: str
) -> None:
    arguments: dict[str, Any] = {"task": task, "profile": "evaluation", "max_episode_steps": 23}
    envs = AirHockeyVectorEnv(WORLDS, autoreset_mode=mode, threads=threads, **arguments)
    reference: Any = SyncVectorEnv([lambda: AirHockeyEnv(**arguments)] * WORLDS, autoreset_mode=mode)
    for actual, expected in [(envs.reset(seed=3), reference.reset(seed=3))]:
        np.testing.assert_array_equal(actual[0], expected[0])
        assert_same_infos(actual[1], expected[1])
    for step in range(60):
        actions = actions_of(envs, step)
        actual, expected = envs.step(actions), reference.step(actions)
        for index in range(4):
            np.testing.assert_array_equal(actual[index], expected[index])
            assert actual[index].dtype == expected[index].dtype
        assert_same_infos(actual[4], expected[4])


def test_ended_worlds_are_reset_by_a_mask() -> None:
    envs = AirHockeyVectorEnv(3, "defend", autoreset_mode="Disabled", max_episode_steps=4)
    envs.reset(seed=[5, 6, 7])
    for _ in range(4):
        observations, _, _, truncated, infos = envs.step(np.zeros((3, 7)))
    assert truncated.all()
    assert infos["_end"].all()
    mask = np.array([True, False, True])
    after, infos = envs.reset(options={"reset_mask": mask})
    np.testing.assert_array_equal(after[1], observations[1])
    np.testing.assert_array_equal(infos["_seed"], mask)
    np.testing.assert_array_equal(infos["episode_number"][mask], [1, 1])
    with pytest.raises(faceoff.OrderError, match="world 1 has ended"):
        envs.step(np.zeros((3, 7)))
    envs.reset(options={"reset_mask": ~mask}, seed=[None, 40, None])
    _, _, _, truncated, _ = envs.step(np.zeros((3, 7)))
    assert not truncated.any()
    single = AirHockeyEnv("defend")
    single.reset(seed=40)
    single.step(np.zeros(7))
    np.testing.assert_array_equal(single.step(np.zeros(7))[0], envs.step(np.zeros((3, 7)))[0][1])


def test_make_vec_gives_the_native_batch() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        envs = gymnasium.make_vec("faceoff/AirHockey-Hit-v0", num_envs=5, profile="evaluation")
    assert isinstance(envs, AirHockeyVectorEnv)
    assert envs.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert envs.single_observation_space.shape == (23,)
    assert envs.observation_space.shape == (5, 23)
    assert envs.action_space.shape == (5, 7)
    assert envs.reset(seed=0)[0] in envs.observation_space


def test_memory_is_reused_without_copies() -> None:
    envs = AirHockeyVectorEnv(4, "hit", copy=False)
    first, _ = envs.reset(seed=0)
    initial = first.copy()
    second, rewards, *_ = envs.step(np.ones((4, 7)))
    assert second is first
    assert not np.array_equal(first, initial)
    assert envs.step(np.ones((4, 7)))[1] is rewards

    envs = AirHockeyVectorEnv(4, "hit")
    first, _ = envs.reset(seed=0)
    second, *_ = envs.step(np.ones((4, 7)))
    np.testing.assert_array_equal(first, initial)
    envs.step(np.ones((4, 7)))
    assert second is not first


@pytest.mark.parametrize("copy", [True, False])
def test_sent_step_equals_a_step(copy: bool) -> None:
    arguments: dict[str, Any] = {"task": "defend", "max_episode_steps": 9, "copy": copy}
    stepped = AirHockeyVectorEnv(8, threads=2, autoreset_mode="SameStep", **arguments)
    sent = AirHockeyVectorEnv(8, threads=2, autoreset_mode="SameStep", **arguments)
    stepped.reset(seed=0)
    sent.reset(seed=0)
    for step in range(30):
        actions = actions_of(stepped, step)
        actual = stepped.step(actions)
        sent.send(actions)
        expected = sent.recv()
        for index in range(4):
            np.testing.assert_array_equal(actual[index], expected[index])
        assert_same_infos(actual[4], expected[4])


def test_calls_between_send_and_recv_are_refused() -> None:
    envs = AirHockeyVectorEnv(4, "hit")
    envs.reset(seed=0)
    with pytest.raises(faceoff.OrderError, match="send"):
        envs.recv()
    envs.send(np.zeros((4, 7)))
    for call in (
        lambda: envs.step(np.zeros((4, 7))),
        lambda: envs.send(np.zeros((4, 7))),
        envs.reset,
        envs.save,
        lambda: pickle.dumps(envs),
    ):
        with pytest.raises(faceoff.OrderError, match="recv"):
            call()
    envs.recv()
    envs.step(np.zeros((4, 7)))
    envs.send(np.zeros((4, 7)))
    envs.close()


def test_states_are_restored_in_vector_and_single_environments() -> None:
    envs = AirHockeyVectorEnv(4, "prepare", profile="evaluation")
    envs.reset(seed=0)
    for step in range(10):
        envs.step(actions_of(envs, step))
    saved = envs.save()
    actions = actions_of(envs, 99)
    expected = envs.step(actions)
    envs.reset(seed=50)
    envs.restore(saved)
    repeated = envs.step(actions)
    for index in range(4):
        np.testing.assert_array_equal(expected[index], repeated[index])
    single = AirHockeyEnv("prepare", profile="evaluation")
    single.restore(pickle.loads(pickle.dumps(saved[2])))
    np.testing.assert_array_equal(single.step(actions[2])[0], expected[0][2])


def test_pickled_worlds_continue_like_the_originals() -> None:
    envs = AirHockeyVectorEnv(3, "hit", profile="evaluation", autoreset_mode="SameStep")
    envs.reset(seed=[8, 1, 4])
    for step in range(10):
        envs.step(actions_of(envs, step))
    twins = pickle.loads(pickle.dumps(envs))
    for step in range(10):
        actual, expected = envs.step(actions_of(envs, step)), twins.step(actions_of(envs, step))
        for index in range(4):
            np.testing.assert_array_equal(actual[index], expected[index])


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_custom_reward_replaces_the_default(mode: AutoresetMode) -> None:
    def single_reward(transition: Transition) -> float:
        return float(transition.next_state.puck[0] - transition.state.puck[0] + transition.action.sum())

    def vector_reward(transition: Transition) -> np.ndarray:
        moved = transition.next_state.puck[:, 0] - transition.state.puck[:, 0]
        return moved + transition.action.sum(axis=1)

    envs = AirHockeyVectorEnv(4, "defend", reward=vector_reward, autoreset_mode=mode, max_episode_steps=11)
    single = AirHockeyEnv("defend", reward=single_reward, max_episode_steps=11)
    envs.reset(seed=0)
    single.reset(seed=2)
    for step in range(11):
        actions = actions_of(envs, step)
        rewards = envs.step(actions)[1]
        assert rewards[2] == pytest.approx(single.step(actions[2])[1], abs=1e-12)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_statistics_wrappers_work(mode: AutoresetMode) -> None:
    envs: Any = AirHockeyVectorEnv(3, "prepare", autoreset_mode=mode, max_episode_steps=5)
    envs = RecordEpisodeStatistics(envs)
    if mode is AutoresetMode.NEXT_STEP:
        envs = NormalizeObservation(envs)
    envs.reset(seed=0)
    lengths = []
    for step in range(20):
        *_, infos = envs.step(actions_of(envs, step))
        if "episode" in infos:
            lengths += infos["episode"]["l"][infos["_episode"]].tolist()
    assert lengths == [5] * 9 if mode is AutoresetMode.NEXT_STEP else [5] * 12


def test_pictures_of_all_worlds() -> None:
    envs = AirHockeyVectorEnv(2, "hit", render_mode="rgb_array")
    envs.reset(seed=0)
    first, second = envs.render()
    assert first.shape == second.shape == (360, 640, 3)
    assert (first != second).any()
