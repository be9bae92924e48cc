"""One world, by Gymnasium's own book."""

import copy
import pickle
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import NormalizeObservation, RecordEpisodeStatistics

import faceoff.gym
from faceoff import _native
from faceoff.gym import AirHockeyEnv, Transition

TASKS = ("hit", "defend", "prepare")


def play(env: Any, actions: np.ndarray) -> list[Any]:
    """Steps until the episode's end, or the last action."""
    told = []
    for action in actions:
        told.append(env.step(action))
        if told[-1][2] or told[-1][3]:
            break
    return told


def some_actions(env: Any, steps: int, seed: int = 0) -> np.ndarray:
    draws = np.random.default_rng(seed).uniform(-1, 1, (steps, *env.action_space.shape))
    return draws.astype(np.float32)


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("profile", ["ideal", "evaluation"])
def test_gymnasiums_checker_has_nothing_to_say(task: str, profile: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(f"faceoff/AirHockey-{task.capitalize()}-v0", profile=profile)
        check_env(env.unwrapped, skip_render_check=True)


@pytest.mark.parametrize("interpolation", [1, 2, 3, 4, 5, -1, None])
@pytest.mark.parametrize("action_mode", ["delta", "absolute", "raw"])
def test_every_interpolation_and_kind_of_action_is_played(interpolation: Any, action_mode: str) -> None:
    env = AirHockeyEnv(
        "defend", interpolation=interpolation, action_mode=action_mode, max_episode_steps=5
    )
    length = {1: 7, 2: 7, 3: 14, 4: 14, 5: 21, -1: 14, None: 420}[interpolation]
    assert env.action_space.shape == (length,)
    assert env.action_space.dtype == np.float32
    assert env.action_space.is_bounded()
    env.reset(seed=1)
    told = play(env, np.array([env.action_space.sample() for _ in range(5)]))
    for observation, reward, *_ in told:
        assert observation in env.observation_space
        assert np.isfinite(reward)


@pytest.mark.parametrize("task", TASKS)
def test_observations_are_finite_singles_of_one_dimension(task: str) -> None:
    env = AirHockeyEnv(task, profile="evaluation")
    assert env.observation_space.shape == ((23,) if task == "hit" else (20,))
    assert env.observation_space.is_bounded()
    observation, _ = env.reset(seed=5)
    assert observation.dtype == np.float32
    for one, *_ in play(env, some_actions(env, 60)):
        assert one.dtype == np.float32
        assert one in env.observation_space


def test_a_horizon_truncates_and_everything_else_terminates() -> None:
    env = AirHockeyEnv("prepare")
    env.reset(seed=0)
    told = play(env, np.zeros((600, 7)))
    assert len(told) == 500
    *_, terminated, truncated, info = told[-1]
    assert (terminated, truncated) == (False, True)
    assert info["end"] == "horizon"
    assert info["steps"] == 500

    env = AirHockeyEnv("defend")
    env.reset(seed=0)
    *_, terminated, truncated, info = play(env, np.zeros((600, 7)))[-1]
    assert (terminated, truncated) == (True, False)
    assert info["end"] in ("crossed_middle", "left_table", "stopped")


def test_an_episode_may_be_cut_off_sooner() -> None:
    env = AirHockeyEnv("prepare", max_episode_steps=7)
    env.reset(seed=0)
    assert [told[3] for told in play(env, np.zeros((20, 7)))] == [False] * 6 + [True]


def test_no_action_keeps_the_arm_in_its_start_pose() -> None:
    """A position of 0 is the last commanded one, or the start pose, so that the arm does not creep."""
    for action_mode in ("delta", "absolute"):
        env = AirHockeyEnv("prepare", action_mode=action_mode)
        env.reset(seed=0)
        start = env.state.mallet
        play(env, np.zeros((100, 7)))
        # Gravity compensation misses the mallet's weight: the arm sags by 2 to 3 mm and stays there.
        assert np.linalg.norm(env.state.mallet - start) < 0.004


@pytest.mark.parametrize("action_mode", ["delta", "absolute"])
def test_full_fractions_command_no_position_beyond_the_constraint(action_mode: str) -> None:
    env = AirHockeyEnv("prepare", action_mode=action_mode)
    env.reset(seed=0)
    play(env, np.ones((500, 7)))
    limits = np.array(_native.joint_limits()[0])
    # The arm stops at 95 %, but for what it sags.
    np.testing.assert_allclose(env.state.q, 0.95 * limits, atol=0.02)


def test_episodes_follow_each_other_as_an_evaluation_plays_them() -> None:
    env = AirHockeyEnv("hit", profile="evaluation")
    first, info = env.reset(seed=9)
    assert info == {"seed": 9, "episode_number": 0}
    second, info = env.reset()
    assert info == {"seed": 9, "episode_number": 1}
    assert not np.array_equal(first, second)
    other = AirHockeyEnv("hit", profile="evaluation")
    chosen, info = other.reset(seed=9, options={"episode": 1})
    assert info["episode_number"] == 1
    np.testing.assert_array_equal(chosen, second)


def test_a_given_puck_is_where_the_episode_starts() -> None:
    env = AirHockeyEnv("defend")
    puck = [0.4, 0.1, 0.0, -2.0, 0.5, 1.0]
    observation, _ = env.reset(seed=0, options={"puck": puck})
    np.testing.assert_allclose(env.state.puck, puck)
    np.testing.assert_allclose(observation[:2], [1.91, 0.1], rtol=1e-6)


def test_an_environment_without_a_seed_draws_one() -> None:
    seeds = {AirHockeyEnv("hit").reset()[1]["seed"] for _ in range(3)}
    assert len(seeds) == 3


def test_another_seed_is_another_robot_unless_the_season_is_given() -> None:
    def sagged(seed: int, **arguments: Any) -> np.ndarray:
        env = AirHockeyEnv("prepare", profile="model_mismatch", **arguments)
        env.reset(seed=seed)
        play(env, np.zeros((50, 7)))
        return env.state.q.copy()

    assert not np.array_equal(sagged(1), sagged(2))
    np.testing.assert_array_equal(sagged(1, mismatch_seed=4), sagged(2, mismatch_seed=4))


def test_factors_can_be_named_one_by_one() -> None:
    def first(profile: Any, **arguments: Any) -> np.ndarray:
        return AirHockeyEnv("defend", profile=profile, **arguments).reset(seed=3)[0]

    ideal, noisy = first("ideal"), first(["observation_noise", "tracking_loss"])
    assert not np.array_equal(ideal, noisy)
    np.testing.assert_array_equal(noisy, first("observation_noise"))
    still = {"puck_position_m", "puck_yaw_rad", "puck_velocity_m_s", "puck_yaw_rate_rad_s"}
    still |= {"joint_position_rad", "joint_velocity_rad_s"}
    calm = {"observation_noise": dict.fromkeys(still, 0.0)}
    np.testing.assert_array_equal(ideal, first("observation_noise", perturbations=calm))


def test_a_saved_state_is_come_back_to_exactly() -> None:
    env = AirHockeyEnv("hit", profile="evaluation", interpolation=3)
    env.reset(seed=2)
    play(env, some_actions(env, 40))
    saved = env.save()
    after = play(env, some_actions(env, 30, seed=1))
    env.reset(seed=77)
    env.restore(saved)
    again = play(env, some_actions(env, 30, seed=1))
    for one, other in zip(after, again, strict=True):
        np.testing.assert_array_equal(one[0], other[0])
        assert one[1:4] == other[1:4]


@pytest.mark.parametrize("how", ["pickle", "copy"])
def test_a_pickled_environment_goes_on_as_the_original_does(how: str) -> None:
    env = gymnasium.make("faceoff/AirHockey-Defend-v0", profile="evaluation", interpolation=5)
    env.reset(seed=4)
    play(env, some_actions(env, 20))
    twin = pickle.loads(pickle.dumps(env)) if how == "pickle" else copy.deepcopy(env)
    for one, other in zip(
        play(env, some_actions(env, 20, seed=1)), play(twin, some_actions(env, 20, seed=1)), strict=True
    ):
        np.testing.assert_array_equal(one[0], other[0])
        assert one[1:4] == other[1:4]


def test_a_pickled_state_survives_and_garbage_does_not() -> None:
    env = AirHockeyEnv("prepare")
    env.reset(seed=4)
    play(env, some_actions(env, 25))
    state = env.save()
    again = pickle.loads(pickle.dumps(state))
    assert (again.seed, again.episode_number, again.steps) == (4, 0, 25)
    env.reset(seed=5)
    env.restore(again)
    np.testing.assert_array_equal(env.save().__reduce__()[1][0], state.__reduce__()[1][0])


def test_the_reward_can_be_replaced() -> None:
    told: list[Transition] = []

    def reward(transition: Transition) -> float:
        told.append(transition)
        return -float(np.abs(transition.next_state.puck[1]))

    env = AirHockeyEnv("prepare", reward=reward)
    first, _ = env.reset(seed=1)
    second, value, *_ = env.step(np.zeros(7))
    third, *_ = env.step(np.zeros(7))
    assert value == -abs(env.state.puck[1])
    np.testing.assert_array_equal(told[0].observation, first)
    np.testing.assert_array_equal(told[0].next_observation, second)
    np.testing.assert_array_equal(told[1].observation, second)
    np.testing.assert_array_equal(told[1].next_observation, third)
    np.testing.assert_array_equal(told[0].next_state.array, told[1].state.array)


def test_the_default_reward_adds_up_to_success_less_penalty_points() -> None:
    """What is left is how much more promising the last state is than the first: at most a few points."""
    env = AirHockeyEnv("defend")
    for seed in range(5):
        env.reset(seed=seed)
        told = play(env, some_actions(env, 500, seed=seed))
        info = told[-1][4]
        points = float(np.dot(info["violations"], [3, 3, 2, 1]))
        shaped = sum(reward for _, reward, *_ in told) - 10 * info["success"] + points
        assert abs(shaped) < 6


def test_statistics_wrappers_work() -> None:
    env = NormalizeObservation(
        RecordEpisodeStatistics(gymnasium.make("faceoff/AirHockey-Defend-v0"))
    )
    env.reset(seed=0)
    told = play(env, some_actions(env, 500))
    assert told[-1][4]["episode"]["l"] == len(told)


def test_pictures_show_the_table() -> None:
    env = gymnasium.make("faceoff/AirHockey-Hit-v0", render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    assert before.shape == (360, 640, 3)
    assert before.dtype == np.uint8
    for _ in range(20):
        env.step(np.ones(7, np.float32))
    assert (env.render() != before).any()


def test_a_window_without_a_display_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    env = AirHockeyEnv("hit", render_mode="human")
    with pytest.raises(faceoff.Error, match="rgb_array"):
        env.reset(seed=0)
