"""Invalid input is refused with an exception that names the argument, the expected and the actual value."""

import pickle
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import faceoff
import faceoff.gym
from commands import diverging_actions
from faceoff import _native
from faceoff.game import AirHockeyGame, SelfPlayEnv
from faceoff.gym import AirHockeyEnv, AirHockeyVectorEnv

# Interpolation codes: 1 to 5: polynomials; -1: position and velocity, each linear; None: a point per millisecond.
ARGUMENTS: list[tuple[dict[str, Any], str]] = [
    ({"task": "score"}, "task: expected one of hit, defend, prepare, got 'score'"),
    ({"task": 3}, "task: expected"),
    ({"interpolation": 6}, "interpolation: expected a whole number from -1 to 5, got 6"),
    ({"interpolation": 0}, "interpolation: expected 1, 2, 3, 4, 5, -1 or None, got 0"),
    ({"interpolation": "cubic"}, "interpolation: expected"),
    ({"interpolation": True}, "interpolation: expected"),
    ({"action_mode": "torque"}, "action_mode: expected one of delta, absolute, raw"),
    ({"profile": "rehearsal"}, "profile: expected one of ideal"),
    ({"profile": ["noise"]}, "profile: expected one of model_mismatch"),
    ({"profile": 1}, "profile: expected"),
    ({"perturbations": [1]}, "perturbations: expected a mapping"),
    ({"perturbations": {"noise": {}}}, "perturbations: expected magnitudes of perturbations by their names, got unknown field"),
    ({"perturbations": {"tracking_loss": {"probability": 2.0}}}, "expected a number from 0 to 1, got 2"),
    ({"perturbations": {"tracking_loss": {"probability": float("nan")}}}, r"perturbations['tracking_loss']['probability']: expected finite"),
    ({"mismatch_seed": "ff"}, "mismatch_seed: expected a number or 64 hexadecimal digits"),
    ({"mismatch_seed": -1}, "mismatch_seed: expected"),
    ({"max_episode_steps": 0}, "max_episode_steps: expected a whole number from 1 to 500, got 0"),
    ({"max_episode_steps": 501}, "got 501"),
    ({"max_episode_steps": 2.5}, "max_episode_steps: expected"),
    ({"reward": 3}, "reward: expected a function"),
    ({"render_mode": "ansi"}, "render_mode: expected"),
]


@pytest.mark.parametrize(("arguments", "message"), ARGUMENTS)
@pytest.mark.parametrize("make", [AirHockeyEnv, lambda **arguments: AirHockeyVectorEnv(2, **arguments)])
def test_environment_arguments_are_checked(make: Callable[..., Any], arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(faceoff.Error) as caught:
        make(**arguments)
    assert message in str(caught.value)
    assert isinstance(caught.value, (ValueError, TypeError))


def test_impossible_mismatch_magnitudes_are_refused_at_once() -> None:
    impossible = {"model_mismatch": {"static_error_m": [0.9, 1.0]}}
    with pytest.raises(faceoff.ArgumentError, match="static error"):
        AirHockeyEnv(profile="model_mismatch", perturbations=impossible)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"num_envs": 0}, "num_envs: expected a whole number from 1"),
        ({"num_envs": 2.5}, "num_envs: expected"),
        ({"num_envs": True}, "num_envs: expected"),
        ({"threads": 0}, "threads: expected a whole number from 1"),
        ({"autoreset_mode": "Later"}, "autoreset_mode: expected one of NextStep, SameStep, Disabled"),
        ({"render_mode": "human"}, "render_mode: expected one of rgb_array"),
    ],
)
def test_vector_environment_arguments_are_checked(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(faceoff.Error, match=message):
        AirHockeyVectorEnv(**arguments)


ACTIONS: list[tuple[Any, str]] = [
    (np.zeros(6), "expected an array of shape"),
    (np.zeros((7, 1)), "expected an array of shape"),
    (0.0, "expected an array of shape"),
    ([[1], [2, 3]], "expected an array of shape"),
    ("seven", "expected real numbers"),
    (None, "expected real numbers"),
    (np.zeros(7, complex), "expected real numbers"),
    (np.array([0, 0, np.nan, 0, 0, 0, 0]), "expected finite numbers, got NaN at index 2"),
    (np.array([0, 0, 0, 0, 0, -np.inf, 0]), "expected finite numbers, got -inf at index 5"),
    (np.array([0, 1.5, 0, 0, 0, 0, 0]), "expected numbers from -1 to 1, got 1.5 at index 1; clip it"),
]


@pytest.mark.parametrize(("action", "message"), ACTIONS)
def test_invalid_actions_are_refused_without_a_step(action: Any, message: str) -> None:
    env = AirHockeyEnv("hit")
    env.reset(seed=0)
    before = env.save()
    with pytest.raises(faceoff.Error) as caught:
        env.step(action)
    assert message in str(caught.value)
    assert str(caught.value).startswith("action: ")
    # The world is unchanged.
    assert pickle.dumps(env.save()) == pickle.dumps(before)


def test_invalid_action_error_names_the_world() -> None:
    envs = AirHockeyVectorEnv(3, "hit")
    envs.reset(seed=0)
    actions = np.zeros((3, 7))
    actions[2, 4] = np.nan
    for call in (envs.step, envs.send):
        with pytest.raises(faceoff.ArgumentError, match="got NaN at index 4 of world 2"):
            call(actions)
        with pytest.raises(faceoff.ArgumentError, match=r"expected an array of shape \(3, 7\)"):
            call(actions[0])
    envs.step(np.zeros((3, 7)))


def test_clipping_accepts_large_numbers_but_not_infinity() -> None:
    env, other = AirHockeyEnv("hit", clip_actions=True), AirHockeyEnv("hit")
    env.reset(seed=0)
    other.reset(seed=0)
    np.testing.assert_array_equal(env.step(np.full(7, -80.0))[0], other.step(np.full(7, -1.0))[0])
    with pytest.raises(faceoff.ArgumentError, match="finite"):
        env.step(np.full(7, np.inf))


def test_raw_actions_have_the_bounds_of_the_server() -> None:
    env = AirHockeyEnv("hit", action_mode="raw")
    env.reset(seed=0)
    with pytest.raises(faceoff.ArgumentError, match="expected numbers from -10000 to 10000, got 10001"):
        env.step(np.full(7, 10001.0))


def test_diverging_commands_end_the_episode_as_agent_fault() -> None:
    env, actions = diverging_actions()
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(action)
        assert observation in env.observation_space
        assert np.isfinite(reward)
    assert info["end"] == "agent_fault"
    assert (terminated, truncated) == (True, False)
    assert not info["success"]


@pytest.mark.parametrize("make", [AirHockeyEnv, lambda: AirHockeyVectorEnv(2)])
def test_calls_before_reset_and_after_close_are_refused(make: Callable[[], Any]) -> None:
    env = make()
    action = np.zeros(env.action_space.shape)
    for call in (lambda: env.step(action), env.save, lambda: env.state):
        with pytest.raises(faceoff.OrderError, match="reset"):
            call()
    env.reset(seed=0)
    env.close()
    env.close()
    calls = (lambda: env.step(action), env.reset, env.save, lambda: env.state)
    for call in calls:
        with pytest.raises(faceoff.ClosedError, match="closed"):
            call()


def test_step_after_the_end_is_refused() -> None:
    env = AirHockeyEnv("hit", max_episode_steps=1)
    env.reset(seed=0)
    env.step(np.zeros(7))
    with pytest.raises(faceoff.OrderError, match=r"ended: call reset\(\) first"):
        env.step(np.zeros(7))
    env.reset()
    env.step(np.zeros(7))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"seed": -1}, "seed: expected a whole number from 0"),
        ({"seed": 2**63}, "seed: expected"),
        ({"seed": 1.5}, "seed: expected"),
        ({"options": {"speed": 1}}, "options: expected episode and puck, got 'speed'"),
        ({"options": 3}, "options: expected a mapping"),
        ({"options": {"episode": -1}}, "expected a whole number from 0"),
        ({"options": {"puck": [0, 0]}}, r"expected an array of shape \(6,\)"),
        ({"options": {"puck": [2.0, 0, 0, 0, 0, 0]}}, "puck: expected x, y"),
        ({"options": {"puck": [0, 0, 0, np.nan, 0, 0]}}, "puck: expected x, y"),
    ],
)
@pytest.mark.parametrize("make", [AirHockeyEnv, lambda: AirHockeyVectorEnv(2)])
def test_reset_arguments_are_checked(make: Callable[[], Any], arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(faceoff.Error, match=message):
        make().reset(**arguments)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"seed": [1]}, "one for each of 2 worlds, got 1"),
        ({"seed": "12"}, "seed: expected"),
        ({"seed": [1, "a"]}, r"seed\[1\]: expected"),
        ({"seed": 2**63 - 1}, "seed"),
        ({"options": {"reset_mask": [True, False]}}, "expected a NumPy array of bool"),
        ({"options": {"reset_mask": np.array([True])}}, r"expected an array of shape \(2,\)"),
        ({"options": {"reset_mask": np.array([False, False])}}, "at least one"),
    ],
)
def test_vector_reset_arguments_are_checked(arguments: dict[str, Any], message: str) -> None:
    envs = AirHockeyVectorEnv(2)
    envs.reset(seed=0)
    with pytest.raises(faceoff.Error, match=message):
        envs.reset(**arguments)


def test_first_reset_of_some_worlds_is_refused() -> None:
    mask = np.array([True, False])
    with pytest.raises(faceoff.OrderError, match="all worlds first"):
        AirHockeyVectorEnv(2).reset(options={"reset_mask": mask})


def test_foreign_and_invalid_states_are_refused() -> None:
    env = AirHockeyEnv("hit")
    env.reset(seed=0)
    other = AirHockeyEnv("hit", interpolation=3)
    with pytest.raises(faceoff.ArgumentError, match="same task, actions, interpolation"):
        other.restore(env.save())
    with pytest.raises(faceoff.ArgumentTypeError, match="state: expected what save"):
        env.restore(b"state")  # type: ignore[arg-type]
    (pickled,) = env.save().__reduce__()[1]
    for data, message in [
        (b"", "a state pickled by faceoff"),
        (b"\x80\x04garbage", "a state pickled by faceoff"),
        (pickled[: len(pickled) // 2], "a state pickled by faceoff"),
        (pickled.replace(b'"seed":0', b'"seed":-1'), "a state pickled by faceoff"),
        (pickled.replace(b'"faceoff":"', b'"faceoff":"9.'), "one pickled by this version"),
        (pickled.replace(b'"actions":[]', b'"actions":[1.0]'), "actions of 7 numbers each"),
        (pickled.replace(b'"actions":[]', b'"actions":[5,5,5,5,5,5,5]'), "expected numbers from -1 to 1"),
        (pickled.replace(b'"puck":null', b'"puck":[9,0,0,0,0,0]'), "puck: expected"),
        (pickled.replace(b'"max_episode_steps":500', b'"max_episode_steps":4000000'), "max_episode_steps"),
    ]:
        assert data != pickled
        with pytest.raises(faceoff.ArgumentError, match=message):
            _native.load_snapshot(data)


@pytest.mark.parametrize("value", [np.nan, "much", None, np.zeros(2)])
def test_invalid_rewards_are_refused(value: Any) -> None:
    env = AirHockeyEnv("hit", reward=lambda transition: value)
    env.reset(seed=0)
    with pytest.raises(faceoff.Error, match="reward: expected"):
        env.step(np.zeros(7))


@pytest.mark.parametrize("value", [1.0, np.zeros(3), np.full(2, np.inf), "much"])
def test_invalid_vector_rewards_are_refused(value: Any) -> None:
    envs = AirHockeyVectorEnv(2, "hit", reward=lambda transition: value)
    envs.reset(seed=0)
    with pytest.raises(faceoff.Error, match="reward: expected"):
        envs.step(np.zeros((2, 7)))


def test_render_without_a_mode_is_refused() -> None:
    for env in (AirHockeyEnv("hit"), AirHockeyVectorEnv(2)):
        env.reset(seed=0)
        with pytest.raises(faceoff.ArgumentError, match="render_mode"):
            env.render()


def test_game_arguments_and_actions_are_checked() -> None:
    for arguments, message in [
        ({"max_steps": 0}, "max_steps"),
        ({"interpolation": (1, 2, 3)}, "a pair"),
        ({"interpolation": (1, 9)}, "interpolation: expected"),
        ({"action_mode": "x"}, "action_mode"),
        ({"profile": "x"}, "profile"),
        ({"reward": 1}, "reward"),
    ]:
        with pytest.raises(faceoff.Error, match=message):
            AirHockeyGame(**arguments)  # type: ignore[arg-type]
    game = AirHockeyGame()
    with pytest.raises(faceoff.OrderError, match="reset"):
        game.step({})
    game.reset(seed=0)
    zeros = np.zeros(7)
    for actions, message in [
        ({"robot_1": zeros}, "got none for robot_2"),
        ({"robot_1": zeros, "robot_2": zeros, "robot_3": zeros}, "got 'robot_3'"),
        ({"robot_1": zeros, "robot_2": np.zeros(3)}, "action of robot_2: expected an array of shape"),
        ({"robot_1": zeros, "robot_2": np.full(7, np.nan)}, "of robot_2"),
        (None, "expected a mapping"),
    ]:
        with pytest.raises(faceoff.Error, match=message):
            game.step(actions)  # type: ignore[arg-type]
    with pytest.raises(faceoff.Error, match="agent: expected"):
        game.observation_space("robot_3")
    game.close()
    with pytest.raises(faceoff.ClosedError):
        game.reset()


def test_opponent_pools_are_checked() -> None:
    for pool, message in [([], "at least one"), ([3], r"opponents\[0\]: expected a function")]:
        with pytest.raises(faceoff.Error, match=message):
            SelfPlayEnv(pool)  # type: ignore[arg-type]
    env = SelfPlayEnv([lambda observation: np.zeros(7)])
    with pytest.raises(faceoff.ArgumentError, match="options"):
        env.reset(options={"opponent": 1})


def test_evaluate_arguments_and_policies_are_checked() -> None:
    def hold(observation: np.ndarray) -> np.ndarray:
        return np.zeros(7)

    for arguments, message in [
        ({"tasks": "score"}, "tasks: expected one of"),
        ({"tasks": []}, "tasks: expected"),
        ({"episodes": 0}, "episodes: expected"),
        ({"profile": "x"}, "profile: expected"),
        ({"seed": "x"}, "seed: expected"),
        ({"seed": 2**64}, "seed: expected"),
        ({"interpolation": 7}, "interpolation: expected"),
        ({"action_mode": "x"}, "action_mode: expected"),
        ({"workers": 0}, "workers: expected"),
        ({"perturbations": {"x": 1}}, "perturbations: expected"),
    ]:
        with pytest.raises(faceoff.Error, match=message):
            faceoff.evaluate(hold, **arguments)  # type: ignore[arg-type]
    for policy, message in [
        (3, "policy: expected a function"),
        ({"hit": hold}, "got none for defend"),
        (lambda observation: np.zeros(6), "action: expected an array of shape"),
        (lambda observation: np.full(7, np.nan), "action: expected finite"),
        (lambda observation: None, "action: expected"),
    ]:
        with pytest.raises(faceoff.Error, match=message):
            faceoff.evaluate(policy, episodes=1)  # type: ignore[arg-type]


def test_panic_becomes_an_error() -> None:
    with pytest.raises(faceoff.Error, match="the simulator failed.*provoked"):
        _native.provoke_panic()


def test_errors_have_standard_and_common_base_classes() -> None:
    assert issubclass(faceoff.ArgumentError, (faceoff.Error, ValueError))
    assert issubclass(faceoff.ArgumentError, faceoff.Error)
    assert issubclass(faceoff.ArgumentTypeError, faceoff.Error)
    assert issubclass(faceoff.ArgumentTypeError, TypeError)
    assert issubclass(faceoff.OrderError, faceoff.Error)
    assert issubclass(faceoff.ClosedError, faceoff.OrderError)


def test_import_of_the_package_loads_no_dependency() -> None:
    script = (
        "import sys, faceoff; "
        "print([name for name in ('numpy', 'gymnasium', 'pettingzoo', 'faceoff._native') if name in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert result.stdout.strip() == "[]"
