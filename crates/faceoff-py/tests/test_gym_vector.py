"""Many worlds: each is the single environment, whatever the mode and the threads."""

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


def assert_same_infos(one: dict[str, Any], other: dict[str, Any]) -> None:
    """Where the mask is set; elsewhere there is nothing to be told."""
    assert set(one) == set(other)
    for name, values in one.items():
        if name.startswith("_"):
            np.testing.assert_array_equal(values, other[name], err_msg=name)
        elif isinstance(values, dict):
            assert_same_infos(values, other[name])
        else:
            told = one[f"_{name}"]
            for mine, theirs in zip(values[told], other[name][told], strict=True):
                np.testing.assert_array_equal(mine, theirs, err_msg=name)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("task", ["hit", "defend"])
def test_every_world_is_the_single_environment_to_the_last_bit(
    mode: AutoresetMode, threads: int, task: str
) -> None:
    arguments: dict[str, Any] = {"task": task, "profile": "evaluation", "max_episode_steps": 23}
    ours = AirHockeyVectorEnv(WORLDS, autoreset_mode=mode, threads=threads, **arguments)
    theirs: Any = SyncVectorEnv([lambda: AirHockeyEnv(**arguments)] * WORLDS, autoreset_mode=mode)
    for mine, yours in [(ours.reset(seed=3), theirs.reset(seed=3))]:
        np.testing.assert_array_equal(mine[0], yours[0])
        assert_same_infos(mine[1], yours[1])
    for step in range(60):
        actions = actions_of(ours, step)
        mine, yours = ours.step(actions), theirs.step(actions)
        for index in range(4):
            np.testing.assert_array_equal(mine[index], yours[index])
            assert mine[index].dtype == yours[index].dtype
        assert_same_infos(mine[4], yours[4])


def test_a_world_that_waits_is_reset_by_a_mask() -> None:
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


def test_without_copies_the_same_memory_is_written_again() -> None:
    envs = AirHockeyVectorEnv(4, "hit", copy=False)
    first, _ = envs.reset(seed=0)
    kept = first.copy()
    second, rewards, *_ = envs.step(np.ones((4, 7)))
    assert second is first
    assert not np.array_equal(first, kept)
    assert envs.step(np.ones((4, 7)))[1] is rewards

    envs = AirHockeyVectorEnv(4, "hit")
    first, _ = envs.reset(seed=0)
    second, *_ = envs.step(np.ones((4, 7)))
    np.testing.assert_array_equal(first, kept)
    envs.step(np.ones((4, 7)))
    assert second is not first


@pytest.mark.parametrize("copy", [True, False])
def test_a_step_that_was_sent_is_the_step(copy: bool) -> None:
    arguments: dict[str, Any] = {"task": "defend", "max_episode_steps": 9, "copy": copy}
    one = AirHockeyVectorEnv(8, threads=2, autoreset_mode="SameStep", **arguments)
    other = AirHockeyVectorEnv(8, threads=2, autoreset_mode="SameStep", **arguments)
    one.reset(seed=0)
    other.reset(seed=0)
    for step in range(30):
        actions = actions_of(one, step)
        mine = one.step(actions)
        other.send(actions)
        yours = other.recv()
        for index in range(4):
            np.testing.assert_array_equal(mine[index], yours[index])
        assert_same_infos(mine[4], yours[4])


def test_nothing_may_come_between_send_and_recv() -> None:
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


def test_states_of_many_worlds_are_come_back_to_and_go_to_a_single_one() -> None:
    envs = AirHockeyVectorEnv(4, "prepare", profile="evaluation")
    envs.reset(seed=0)
    for step in range(10):
        envs.step(actions_of(envs, step))
    saved = envs.save()
    actions = actions_of(envs, 99)
    after = envs.step(actions)
    envs.reset(seed=50)
    envs.restore(saved)
    again = envs.step(actions)
    for index in range(4):
        np.testing.assert_array_equal(after[index], again[index])
    single = AirHockeyEnv("prepare", profile="evaluation")
    single.restore(pickle.loads(pickle.dumps(saved[2])))
    np.testing.assert_array_equal(single.step(actions[2])[0], after[0][2])


def test_pickled_worlds_go_on_as_the_originals_do() -> None:
    envs = AirHockeyVectorEnv(3, "hit", profile="evaluation", autoreset_mode="SameStep")
    envs.reset(seed=[8, 1, 4])
    for step in range(10):
        envs.step(actions_of(envs, step))
    twins = pickle.loads(pickle.dumps(envs))
    for step in range(10):
        mine, yours = envs.step(actions_of(envs, step)), twins.step(actions_of(envs, step))
        for index in range(4):
            np.testing.assert_array_equal(mine[index], yours[index])


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_the_reward_of_all_worlds_can_be_replaced(mode: AutoresetMode) -> None:
    def of_one(transition: Transition) -> float:
        return float(transition.next_state.puck[0] - transition.state.puck[0] + transition.action.sum())

    def of_all(transition: Transition) -> np.ndarray:
        moved = transition.next_state.puck[:, 0] - transition.state.puck[:, 0]
        return moved + transition.action.sum(axis=1)

    envs = AirHockeyVectorEnv(4, "defend", reward=of_all, autoreset_mode=mode, max_episode_steps=11)
    single = AirHockeyEnv("defend", reward=of_one, max_episode_steps=11)
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
    one, other = envs.render()
    assert one.shape == other.shape == (360, 640, 3)
    assert (one != other).any()
