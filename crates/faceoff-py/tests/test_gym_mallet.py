"""Wrappers whose actions are mallet velocities."""

import warnings
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import RecordEpisodeStatistics, TimeLimit
from gymnasium.wrappers.vector import RecordEpisodeStatistics as VectorStatistics

import faceoff
from faceoff.gym import AirHockeyEnv, AirHockeyVectorEnv, MalletPlane, MalletPlaneVector
from faceoff.kinematics import MalletMotion, native


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.0, 1.0), (0.5, -1.0)])
def test_mallet_follows_commands_within_constraints(direction: tuple[float, float]) -> None:
    base = AirHockeyEnv("prepare", action_mode="raw", interpolation=3)
    env = MalletPlane(base, max_speed_m_s=0.5)
    assert env.action_space.shape == (2,)
    env.reset(seed=0)
    start = base.state.mallet
    for _ in range(30):
        *_, info = env.step(np.array(direction))
        assert (info["constraints"] < 0).all()
    moved = base.state.mallet - start
    # The mallet accelerates first, and the arm lags a little.
    np.testing.assert_allclose(moved[:2], 0.3 * np.array(direction), atol=0.03)


def test_mallet_stays_in_its_region_under_any_command() -> None:
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


def test_gymnasium_checker_passes() -> None:
    env = MalletPlane(AirHockeyEnv("defend", action_mode="raw", interpolation=3))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # The wrapper itself is the object of the check.
        warnings.filterwarnings("ignore", message=".*different from the unwrapped version.*")
        check_env(env, skip_render_check=True)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_vector_wrapper_equals_the_single_wrapper(mode: AutoresetMode) -> None:
    arguments: dict[str, Any] = {"action_mode": "raw", "interpolation": 3, "max_episode_steps": 9}
    envs = MalletPlaneVector(AirHockeyVectorEnv(3, "defend", autoreset_mode=mode, **arguments))
    single = MalletPlane(AirHockeyEnv("defend", **arguments))
    envs.reset(seed=4)
    single.reset(seed=5)
    draws = np.random.default_rng(0)
    restart = False
    for _ in range(40):
        actions = draws.uniform(-1, 1, (3, 2))
        observations, *_ = envs.step(actions)
        if restart and mode is AutoresetMode.NEXT_STEP:
            observation, _ = single.reset()
            restart = False
        else:
            observation, _, terminated, truncated, _ = single.step(actions[1])
            restart = terminated or truncated
            if restart and mode is AutoresetMode.SAME_STEP:
                observation, _ = single.reset()
        np.testing.assert_allclose(observations[1], observation, atol=1e-5)


def test_mallets_are_commanded_by_the_compiled_inverse() -> None:
    """The results are equal bit for bit, which NumPy does not guarantee on other machines."""
    env = MalletPlane(AirHockeyEnv("hit", action_mode="raw", interpolation=3))
    env.reset(seed=0)
    motion = MalletMotion(1, 1.0, native.inverse)
    for action in np.random.default_rng(0).uniform(-1, 1, (50, 2)):
        np.testing.assert_array_equal(env.action(action), motion.command(action[None])[0])


def test_invalid_environments_and_actions_are_refused() -> None:
    with pytest.raises(faceoff.ArgumentError, match="action_mode='raw'"):
        MalletPlane(AirHockeyEnv("hit"))
    with pytest.raises(faceoff.ArgumentError, match="max_speed_m_s"):
        MalletPlane(AirHockeyEnv("hit", action_mode="raw", interpolation=3), max_speed_m_s=0.0)
    for speed in ("fast", None, True, [1.0]):
        with pytest.raises(faceoff.ArgumentTypeError, match="max_speed_m_s: expected a number"):
            MalletPlane(AirHockeyEnv("hit", action_mode="raw", interpolation=3), max_speed_m_s=speed)  # type: ignore[arg-type]
    env = MalletPlane(AirHockeyEnv("hit", action_mode="raw", interpolation=3))
    env.reset(seed=0)
    with pytest.raises(faceoff.ArgumentError, match="finite"):
        env.step(np.array([np.nan, 0.0]))
    with pytest.raises(faceoff.ArgumentError, match="shape"):
        env.step(np.zeros(3))


def test_wrappers_keep_the_metadata_that_recorders_read() -> None:
    env = MalletPlane(AirHockeyEnv("defend", action_mode="raw", interpolation=3, render_mode="rgb_array"))
    single = RecordEpisodeStatistics(TimeLimit(env, 20))
    envs = AirHockeyVectorEnv(2, "defend", action_mode="raw", interpolation=3, render_mode="rgb_array")
    many = VectorStatistics(MalletPlaneVector(envs))
    for recorded in (single, many):
        assert (recorded.metadata["render_fps"], recorded.render_mode) == (50, "rgb_array")
    single.reset(seed=1)
    many.reset(seed=1)
    for _ in range(20):
        *_, info = single.step(np.zeros(2))
    assert info["episode"]["l"] == 20
