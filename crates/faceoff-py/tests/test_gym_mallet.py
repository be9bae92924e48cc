"""Actions that move the mallet over the table."""

import warnings
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import faceoff
from faceoff.gym import AirHockeyEnv, AirHockeyVectorEnv, MalletPlane, MalletPlaneVector
from faceoff.kinematics import MalletMotion, native


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.0, 1.0), (0.5, -1.0)])
def test_the_mallet_goes_where_it_is_sent_and_breaks_nothing(direction: tuple[float, float]) -> None:
    base = AirHockeyEnv("prepare", action_mode="raw", interpolation=3)
    env = MalletPlane(base, max_speed_m_s=0.5)
    assert env.action_space.shape == (2,)
    env.reset(seed=0)
    start = base.state.mallet
    for _ in range(30):
        *_, info = env.step(np.array(direction))
        assert (info["constraints"] < 0).all()
    moved = base.state.mallet - start
    # It gains speed first, and the arm lags a little behind.
    np.testing.assert_allclose(moved[:2], 0.3 * np.array(direction), atol=0.03)


def test_one_that_is_sent_everywhere_stays_in_its_region() -> None:
    base = AirHockeyEnv("prepare", action_mode="raw", interpolation=3)
    env = MalletPlane(base, max_speed_m_s=1.0)
    env.reset(seed=0)
    draws = np.random.default_rng(0)
    for _ in range(10):
        action = draws.choice([-1.0, 1.0], 2)
        for _ in range(40):
            *_, terminated, truncated, info = env.step(action)
            assert (info["constraints"] < 0).all()
            if terminated or truncated:
                env.reset()


def test_gymnasiums_checker_has_nothing_to_say() -> None:
    env = MalletPlane(AirHockeyEnv("defend", action_mode="raw", interpolation=3))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # It is a wrapper, and is meant to be checked as one.
        warnings.filterwarnings("ignore", message=".*different from the unwrapped version.*")
        check_env(env, skip_render_check=True)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_many_mallets_move_as_each_alone(mode: AutoresetMode) -> None:
    arguments: dict[str, Any] = {"action_mode": "raw", "interpolation": 3, "max_episode_steps": 9}
    envs = MalletPlaneVector(AirHockeyVectorEnv(3, "defend", autoreset_mode=mode, **arguments))
    one = MalletPlane(AirHockeyEnv("defend", **arguments))
    envs.reset(seed=4)
    one.reset(seed=5)
    draws = np.random.default_rng(0)
    restart = False
    for _ in range(40):
        actions = draws.uniform(-1, 1, (3, 2))
        observations, *_ = envs.step(actions)
        if restart and mode is AutoresetMode.NEXT_STEP:
            observation, _ = one.reset()
            restart = False
        else:
            observation, _, terminated, truncated, _ = one.step(actions[1])
            restart = terminated or truncated
            if restart and mode is AutoresetMode.SAME_STEP:
                observation, _ = one.reset()
        np.testing.assert_allclose(observations[1], observation, atol=1e-5)


def test_mallets_are_commanded_by_the_compiled_inverse() -> None:
    """To the last bit, which NumPy's would not give on another machine."""
    env = MalletPlane(AirHockeyEnv("hit", action_mode="raw", interpolation=3))
    env.reset(seed=0)
    motion = MalletMotion(1, 1.0, native.inverse)
    for action in np.random.default_rng(0).uniform(-1, 1, (50, 2)):
        np.testing.assert_array_equal(env.action(action), motion.command(action[None])[0])


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(faceoff.ArgumentError, match="action_mode='raw'"):
        MalletPlane(AirHockeyEnv("hit"))
    with pytest.raises(faceoff.ArgumentError, match="max_speed_m_s"):
        MalletPlane(AirHockeyEnv("hit", action_mode="raw", interpolation=3), max_speed_m_s=0.0)
    env = MalletPlane(AirHockeyEnv("hit", action_mode="raw", interpolation=3))
    env.reset(seed=0)
    with pytest.raises(faceoff.ArgumentError, match="finite"):
        env.step(np.array([np.nan, 0.0]))
    with pytest.raises(faceoff.ArgumentError, match="shape"):
        env.step(np.zeros(3))
