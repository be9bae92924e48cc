"""The environment of one world (a simulated table), with Gymnasium's checks."""

import copy
import pickle
import subprocess
import sys
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import MaxAndSkipObservation, NormalizeObservation, RecordEpisodeStatistics, TimeLimit

import faceoff.gym
from faceoff import _native
from faceoff.gym import AirHockeyEnv, Transition

TASKS = ("hit", "defend", "prepare")


def play(env: Any, actions: np.ndarray) -> list[Any]:
    """The results of steps until the episode's end or the last action."""
    results = []
    for action in actions:
        results.append(env.step(action))
        if results[-1][2] or results[-1][3]:
            break
    return results


def random_actions(env: Any, steps: int, seed: int = 0) -> np.ndarray:
    """Actions for a number of steps."""
    draws = np.random.default_rng(seed).uniform(-1, 1, (steps, *env.action_space.shape))
    return draws.astype(np.float32)


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("profile", ["ideal", "evaluation"])
def test_gymnasium_checker_passes(task: str, profile: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(f"faceoff/AirHockey-{task.capitalize()}-v0", profile=profile)
        check_env(env.unwrapped, skip_render_check=True)


# Codes of the protocol: 1 to 5 are degrees of polynomials; -1 is a position and a velocity, each linear; None is a
# trajectory, with 3 x 7 numbers for each of the 20 milliseconds of a control step.
@pytest.mark.parametrize("interpolation", [1, 2, 3, 4, 5, -1, None])
@pytest.mark.parametrize("action_mode", ["delta", "absolute", "raw"])
def test_interpolations_and_action_modes_can_be_stepped(interpolation: Any, action_mode: str) -> None:
    env = AirHockeyEnv(
        "defend", interpolation=interpolation, action_mode=action_mode, max_episode_steps=5
    )
    length = {1: 7, 2: 7, 3: 14, 4: 14, 5: 21, -1: 14, None: 420}[interpolation]
    assert env.action_space.shape == (length,)
    assert env.action_space.dtype == np.float32
    assert env.action_space.is_bounded()
    env.reset(seed=1)
    results = play(env, np.array([env.action_space.sample() for _ in range(5)]))
    for observation, reward, *_ in results:
        assert observation in env.observation_space
        assert np.isfinite(reward)


@pytest.mark.parametrize("task", TASKS)
def test_observations_are_bounded_float32_vectors(task: str) -> None:
    env = AirHockeyEnv(task, profile="evaluation")
    assert env.observation_space.shape == ((23,) if task == "hit" else (20,))
    assert env.observation_space.is_bounded()
    observation, _ = env.reset(seed=5)
    assert observation.dtype == np.float32
    for observation, *_ in play(env, random_actions(env, 60)):
        assert observation.dtype == np.float32
        assert observation in env.observation_space


def test_horizon_truncates_and_other_ends_terminate() -> None:
    env = AirHockeyEnv("prepare")
    env.reset(seed=0)
    results = play(env, np.zeros((600, 7)))
    assert len(results) == 500
    *_, terminated, truncated, info = results[-1]
    assert (terminated, truncated) == (False, True)
    assert info["end"] == "horizon"
    assert info["steps"] == 500

    env = AirHockeyEnv("defend")
    env.reset(seed=0)
    *_, terminated, truncated, info = play(env, np.zeros((600, 7)))[-1]
    assert (terminated, truncated) == (True, False)
    assert info["end"] in ("crossed_middle", "left_table", "stopped")


def test_max_episode_steps_truncates_earlier() -> None:
    env = AirHockeyEnv("prepare", max_episode_steps=7)
    env.reset(seed=0)
    assert [result[3] for result in play(env, np.zeros((20, 7)))] == [False] * 6 + [True]


def test_zero_actions_keep_the_arm_in_its_start_pose() -> None:
    """A position of 0 is the last commanded one, or the start pose, so the arm does not drift."""
    for action_mode in ("delta", "absolute"):
        env = AirHockeyEnv("prepare", action_mode=action_mode)
        env.reset(seed=0)
        start = env.state.mallet
        play(env, np.zeros((100, 7)))
        # Gravity compensation misses the mallet's weight: the arm sags by 2 to 3 mm and stays there.
        assert np.linalg.norm(env.state.mallet - start) < 0.004


@pytest.mark.parametrize("action_mode", ["delta", "absolute"])
def test_full_actions_stay_within_position_constraints(action_mode: str) -> None:
    env = AirHockeyEnv("prepare", action_mode=action_mode)
    env.reset(seed=0)
    play(env, np.ones((500, 7)))
    limits = np.array(_native.joint_limits()[0])
    # The arm stops at 95 %, except for its sag.
    np.testing.assert_allclose(env.state.q, 0.95 * limits, atol=0.02)


def test_episodes_have_the_order_of_an_evaluation() -> None:
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


def test_puck_option_sets_the_initial_state() -> None:
    env = AirHockeyEnv("defend")
    puck = [0.4, 0.1, 0.0, -2.0, 0.5, 1.0]
    observation, _ = env.reset(seed=0, options={"puck": puck})
    np.testing.assert_allclose(env.state.puck, puck)
    np.testing.assert_allclose(observation[:2], [1.91, 0.1], rtol=1e-6)


def test_reset_without_seed_draws_one() -> None:
    seeds = {AirHockeyEnv("hit").reset()[1]["seed"] for _ in range(3)}
    assert len(seeds) == 3


def test_seeds_have_their_own_robot_without_a_mismatch_seed() -> None:
    def settled_pose(seed: int, **arguments: Any) -> np.ndarray:
        env = AirHockeyEnv("prepare", profile="model_mismatch", **arguments)
        env.reset(seed=seed)
        play(env, np.zeros((50, 7)))
        return env.state.q.copy()

    assert not np.array_equal(settled_pose(1), settled_pose(2))
    np.testing.assert_array_equal(settled_pose(1, mismatch_seed=4), settled_pose(2, mismatch_seed=4))


def test_profile_accepts_names_of_perturbations() -> None:
    def first(profile: Any, **arguments: Any) -> np.ndarray:
        return AirHockeyEnv("defend", profile=profile, **arguments).reset(seed=3)[0]

    ideal, noisy = first("ideal"), first(["observation_noise", "tracking_loss"])
    assert not np.array_equal(ideal, noisy)
    np.testing.assert_array_equal(noisy, first("observation_noise"))
    names = {"puck_position_m", "puck_yaw_rad", "puck_velocity_m_s", "puck_yaw_rate_rad_s"}
    names |= {"joint_position_rad", "joint_velocity_rad_s"}
    zero_noise = {"observation_noise": dict.fromkeys(names, 0.0)}
    np.testing.assert_array_equal(ideal, first("observation_noise", perturbations=zero_noise))


def test_saved_state_is_restored_exactly() -> None:
    env = AirHockeyEnv("hit", profile="evaluation", interpolation=3)
    env.reset(seed=2)
    play(env, random_actions(env, 40))
    saved = env.save()
    expected = play(env, random_actions(env, 30, seed=1))
    env.reset(seed=77)
    env.restore(saved)
    repeated = play(env, random_actions(env, 30, seed=1))
    for first, second in zip(expected, repeated, strict=True):
        np.testing.assert_array_equal(first[0], second[0])
        assert first[1:4] == second[1:4]


@pytest.mark.parametrize("method", ["pickle", "copy"])
def test_pickled_environment_continues_like_the_original(method: str) -> None:
    env = gymnasium.make("faceoff/AirHockey-Defend-v0", profile="evaluation", interpolation=5)
    env.reset(seed=4)
    play(env, random_actions(env, 20))
    twin = pickle.loads(pickle.dumps(env)) if method == "pickle" else copy.deepcopy(env)
    for original, copied in zip(
        play(env, random_actions(env, 20, seed=1)), play(twin, random_actions(env, 20, seed=1)), strict=True
    ):
        np.testing.assert_array_equal(original[0], copied[0])
        assert original[1:4] == copied[1:4]


def test_pickled_state_is_restored_exactly() -> None:
    """A pickle stores the episode's start and its actions, which are simulated again when it is loaded."""
    env = AirHockeyEnv("prepare")
    env.reset(seed=4)
    play(env, random_actions(env, 25))
    saved = env.save()
    expected_state = env.state.array
    expected_results = play(env, random_actions(env, 30, seed=1))
    loaded = pickle.loads(pickle.dumps(saved))
    assert (loaded.seed, loaded.episode_number, loaded.steps) == (4, 0, 25)
    env.reset(seed=5)
    assert not np.array_equal(env.state.array, expected_state)
    env.restore(loaded)
    np.testing.assert_array_equal(env.state.array, expected_state)
    repeated = play(env, random_actions(env, 30, seed=1))
    for first, second in zip(expected_results, repeated, strict=True):
        np.testing.assert_array_equal(first[0], second[0])
        assert first[1:4] == second[1:4]


def test_custom_reward_replaces_the_default() -> None:
    transitions: list[Transition] = []

    def reward(transition: Transition) -> float:
        transitions.append(transition)
        return -float(np.abs(transition.next_state.puck[1]))

    env = AirHockeyEnv("prepare", reward=reward)
    first, _ = env.reset(seed=1)
    second, value, *_ = env.step(np.zeros(7))
    third, *_ = env.step(np.zeros(7))
    assert value == -abs(env.state.puck[1])
    np.testing.assert_array_equal(transitions[0].observation, first)
    np.testing.assert_array_equal(transitions[0].next_observation, second)
    np.testing.assert_array_equal(transitions[1].observation, second)
    np.testing.assert_array_equal(transitions[1].next_observation, third)
    np.testing.assert_array_equal(transitions[0].next_state.array, transitions[1].state.array)


def test_default_reward_sums_to_success_minus_penalty_points() -> None:
    """The remainder is the change of the potential, at most a few points."""
    env = AirHockeyEnv("defend")
    for seed in range(5):
        env.reset(seed=seed)
        results = play(env, random_actions(env, 500, seed=seed))
        info = results[-1][4]
        # Points of the constraints end effector, link, joint position and joint velocity.
        points = float(np.dot(info["violations"], [3, 3, 2, 1]))
        shaped = sum(reward for _, reward, *_ in results) - 10 * info["success"] + points
        assert abs(shaped) < 6


def test_statistics_wrappers_work() -> None:
    env = NormalizeObservation(
        RecordEpisodeStatistics(gymnasium.make("faceoff/AirHockey-Defend-v0"))
    )
    env.reset(seed=0)
    results = play(env, random_actions(env, 500))
    assert results[-1][4]["episode"]["l"] == len(results)


def test_pictures_show_the_table() -> None:
    env = gymnasium.make("faceoff/AirHockey-Hit-v0", render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    assert before.shape == (360, 640, 3)
    assert before.dtype == np.uint8
    for _ in range(20):
        env.step(np.ones(7, np.float32))
    assert (env.render() != before).any()


def test_human_mode_without_display_warns_and_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    env = AirHockeyEnv("hit", render_mode="human")
    with pytest.warns(RuntimeWarning, match="rgb_array"):
        env.reset(seed=0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env.step(np.zeros(7))
    env.close()


@pytest.mark.parametrize("task", ["hit", "defend", "prepare"])
def test_checks_of_all_render_modes_pass_without_display(task: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    env = gymnasium.make(f"faceoff/AirHockey-{task.capitalize()}-v0")
    with pytest.warns(RuntimeWarning, match="needs"):
        check_env(env.unwrapped)


# --- arguments of gymnasium.make ---------------------------------------------------------------------------------


def play_to_the_end(env: Any, **reset: Any) -> tuple[int, dict[str, Any]]:
    """Plays an episode without motion; the number of its steps, and the last step's info. `reset`: arguments of `reset`."""
    env.reset(**reset)
    for steps in range(1, 1_000):
        *_, terminated, truncated, info = env.step(np.zeros(7, np.float32))
        if terminated or truncated:
            return steps, info
    raise AssertionError("the episode does not end")


def test_time_limit_of_make_ends_episodes_with_their_outcome() -> None:
    limited = gymnasium.make("faceoff/AirHockey-Prepare-v0", max_episode_steps=30, profile="evaluation")
    own = AirHockeyEnv("prepare", max_episode_steps=30, profile="evaluation")
    for episode in range(3):
        seed = {"seed": 5} if episode == 0 else {}
        steps, info = play_to_the_end(limited, **seed)
        own_steps, own_info = play_to_the_end(own, **seed)
        assert (steps, info["end"], info["success"]) == (own_steps, own_info["end"], own_info["success"])
        assert info["steps"] == 30
    assert limited.unwrapped.save().episode_number == 2


def test_time_limit_added_later_keeps_the_seed() -> None:
    env = AirHockeyEnv("prepare")
    env.reset(seed=5)
    steps, info = play_to_the_end(TimeLimit(env, 10))
    assert (steps, info["end"]) == (10, "horizon")
    assert env.reset()[1] == {"seed": 5, "episode_number": 2}
    assert play_to_the_end(env)[0] > 10, "the limit is that of the wrapper"


def test_time_limit_around_other_wrappers_counts_their_steps() -> None:
    env = TimeLimit(MaxAndSkipObservation(AirHockeyEnv("prepare"), skip=4), 50)
    steps, info = play_to_the_end(env, seed=5)
    assert steps == 50


def test_refused_reset_with_a_time_limit_changes_nothing() -> None:
    env = AirHockeyEnv("prepare")
    env.reset(seed=5)
    with pytest.raises(faceoff.ArgumentError, match="puck"):
        TimeLimit(env, 50).reset(options={"puck": [np.nan] * 6})
    assert env.reset()[1] == {"seed": 5, "episode_number": 1}


def test_state_moves_between_environments_with_a_time_limit() -> None:
    first, second = (gymnasium.make("faceoff/AirHockey-Prepare-v0", max_episode_steps=40) for _ in range(2))
    first.reset(seed=5)
    first.step(np.full(7, 0.5, np.float32))
    observation, info = second.unwrapped.restore(first.unwrapped.save())
    assert info == {"seed": 5, "episode_number": 0}
    np.testing.assert_array_equal(observation, first.unwrapped._rows.observations[0])


@pytest.mark.parametrize("steps", [501, 100_000])
def test_time_limit_out_of_range_is_refused(steps: int) -> None:
    message = f"max_episode_steps: expected a whole number from 1 to 500, got {steps}"
    with pytest.raises(faceoff.ArgumentError, match=message):
        gymnasium.make("faceoff/AirHockey-Defend-v0", max_episode_steps=steps).reset(seed=0)
    with pytest.raises(faceoff.ArgumentError, match=message):
        gymnasium.make_vec("faceoff/AirHockey-Defend-v0", num_envs=2, max_episode_steps=steps)


def test_make_imports_the_module_of_its_id() -> None:
    """In a process that has not imported `faceoff.gym`, such as a worker that is spawned."""
    program = (
        "import gymnasium, sys; env = gymnasium.make('faceoff.gym:faceoff/AirHockey-Defend-v0');"
        "print(env.reset(seed=1)[1], 'faceoff.gym' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, timeout=600, text=True)
    assert done.stdout == "{'seed': 1, 'episode_number': 0} True\n"


@pytest.mark.parametrize("context", ["fork", "forkserver", "spawn"])
def test_workers_of_every_start_method_make_the_environment(context: str) -> None:
    ident = "faceoff.gym:faceoff/AirHockey-Defend-v0"
    envs = gymnasium.make_vec(ident, num_envs=2, vectorization_mode="async", vector_kwargs={"context": context})
    observations, _ = envs.reset(seed=3)
    alone, _ = AirHockeyEnv("defend").reset(seed=4)
    np.testing.assert_array_equal(observations[1], alone)
    envs.close()


def test_spec_makes_the_same_environment() -> None:
    env = gymnasium.make("faceoff/AirHockey-Prepare-v0", max_episode_steps=30, profile="evaluation")
    assert env.spec is not None
    twin = gymnasium.make(gymnasium.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    first, other = play_to_the_end(env, seed=2), play_to_the_end(twin, seed=2)
    assert (first[0], first[1]["end"]) == (other[0], other[1]["end"]) == (30, "horizon")


def test_arguments_of_other_number_types_are_accepted() -> None:
    reference = AirHockeyEnv("defend", max_episode_steps=100, interpolation=3, mismatch_seed=7)
    loose = AirHockeyEnv(
        "defend",
        max_episode_steps=np.float32(100),  # type: ignore[arg-type]
        interpolation=np.array(3),  # type: ignore[arg-type]
        mismatch_seed=np.uint64(7),  # type: ignore[arg-type]
        clip_actions=np.True_,  # type: ignore[arg-type]
        perturbations={"tracking_loss": {"probability": np.float32(0.0)}},
    )
    expected, _ = reference.reset(seed=3)
    observation, _ = loose.reset(seed=3.0)  # type: ignore[arg-type]
    np.testing.assert_array_equal(observation, expected)
    np.testing.assert_array_equal(
        loose.step(np.zeros(14, np.int8))[0], reference.step([0.0] * 14)[0]
    )
