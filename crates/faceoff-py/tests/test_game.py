"""The game of two robots, with PettingZoo's checks."""

import warnings
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import RecordEpisodeStatistics
from commands import runaway_action
from pettingzoo.test import parallel_api_test, parallel_seed_test

from faceoff.game import AGENTS, AirHockeyGame, GameTransition, SelfPlayEnv


def hold(observation: np.ndarray) -> np.ndarray:
    return np.zeros(7)


def actions_of_both(value: float = 0.0) -> dict[str, np.ndarray]:
    return {agent: np.full(7, value) for agent in AGENTS}


def test_pettingzoo_checks_pass() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parallel_api_test(AirHockeyGame(max_steps=120), num_cycles=300)
        parallel_seed_test(lambda: AirHockeyGame(max_steps=60))


def test_game_is_truncated_for_both_agents() -> None:
    game = AirHockeyGame(max_steps=3)
    observations, infos = game.reset(seed=1)
    assert infos["robot_2"] == {"seed": 1, "game_number": 0}
    assert observations["robot_1"].shape == (23,)
    for _ in range(2):
        *_, truncations, _ = game.step(actions_of_both())
        assert truncations == {"robot_1": False, "robot_2": False}
    _, _, terminations, truncations, _ = game.step(actions_of_both())
    assert terminations == {"robot_1": False, "robot_2": False}
    assert truncations == {"robot_1": True, "robot_2": True}
    assert game.agents == []


def test_observations_are_from_the_own_side() -> None:
    game = AirHockeyGame()
    observations, _ = game.reset(seed=1)
    first, second = observations["robot_1"], observations["robot_2"]
    # Each base is 1.51 m from the table's centre.
    np.testing.assert_allclose(first[0] + second[0], 2 * 1.51, rtol=1e-6)
    np.testing.assert_allclose(first[1], -second[1], rtol=1e-6)


def test_reset_without_seed_begins_the_next_game_of_the_seed() -> None:
    game, twin = AirHockeyGame(), AirHockeyGame()
    first, _ = game.reset(seed=1)
    second, infos = game.reset()
    assert infos["robot_1"]["game_number"] == 1
    assert not np.array_equal(first["robot_1"], second["robot_1"])
    twin.reset(seed=1)
    np.testing.assert_array_equal(twin.reset()[0]["robot_1"], second["robot_1"])


def test_idle_puck_is_a_foul_and_begins_the_next_rally() -> None:
    game = AirHockeyGame()
    game.reset(seed=1)
    for _ in range(800):
        *_, infos = game.step(actions_of_both())
        if "rally_end" in infos["robot_1"]:
            break
    assert infos["robot_1"]["rally_end"] == "foul"
    by = infos["robot_1"]["rally_end_by"]
    assert infos["robot_2"]["fouls"] == ((1, 0) if by == "robot_1" else (0, 1))
    game.step(actions_of_both())


def test_reward_is_the_difference_of_points() -> None:
    """Every third foul is a point for the other side."""
    game = AirHockeyGame()
    game.reset(seed=1)
    total = {agent: 0.0 for agent in AGENTS}
    for _ in range(6_000):
        _, rewards, _, _, infos = game.step(actions_of_both())
        for agent in AGENTS:
            total[agent] += rewards[agent]
        if sum(infos["robot_1"]["score"]) > 0:
            break
    first, second = infos["robot_1"]["score"]
    assert first + second == 1
    assert (total["robot_1"], total["robot_2"]) == (first - second, second - first)


def test_diverging_robot_is_terminated_and_the_other_continues() -> None:
    game = AirHockeyGame(interpolation=(None, 1), action_mode=("raw", "delta"))
    observations, _ = game.reset(seed=1)
    for _ in range(1_500):
        actions = {"robot_1": runaway_action(*np.split(observations["robot_1"][6:20], 2)), "robot_2": np.zeros(7)}
        observations, rewards, terminations, _, _ = game.step(actions)
        if terminations["robot_1"]:
            break
    assert terminations == {"robot_1": True, "robot_2": False}
    assert rewards["robot_1"] == -10.0
    assert game.agents == ["robot_2"]
    observations, *_ = game.step({"robot_2": np.zeros(7)})
    assert list(observations) == ["robot_2"]


def test_custom_reward_replaces_the_default() -> None:
    def reward(transition: GameTransition) -> tuple[float, float]:
        return float(transition.puck[0]), float(transition.robots[1, 14])

    game = AirHockeyGame(reward=reward)
    game.reset(seed=1)
    _, rewards, *_ = game.step(actions_of_both())
    assert -0.8 < rewards["robot_1"] < 0.8
    assert rewards["robot_2"] == pytest.approx(0.65, abs=0.01)


def test_pictures_show_both_robots() -> None:
    game = AirHockeyGame(render_mode="rgb_array")
    game.reset(seed=1)
    before = game.render()
    assert before is not None
    for _ in range(20):
        game.step(actions_of_both(1.0))
    after = game.render()
    assert after is not None
    changed = (before != after).any(axis=2)
    assert changed[:, :320].any()
    assert changed[:, 320:].any()


@pytest.mark.parametrize("side", ["robot_1", "robot_2", "random"])
def test_side_of_a_game_is_a_gymnasium_environment(side: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Checks spaces, seeds and determinism. There is no spec, because it is not made by an id.
        warnings.filterwarnings("ignore", message=".*spec.*")
        check_env(SelfPlayEnv([hold], side=side, max_steps=50), skip_render_check=True)


def test_opponents_are_drawn_from_a_growing_pool() -> None:
    class CountingOpponent:
        def __init__(self) -> None:
            self.games = self.steps = 0

        def reset(self) -> None:
            self.games += 1

        def __call__(self, observation: np.ndarray) -> np.ndarray:
            assert observation.shape == (23,)
            self.steps += 1
            return np.zeros(7)

    first, second, late = CountingOpponent(), CountingOpponent(), CountingOpponent()
    env = SelfPlayEnv([first, second], max_steps=5)
    stats: Any = RecordEpisodeStatistics(env)
    drawn = []
    for game in range(12):
        _, info = stats.reset(seed=3 if game == 0 else None)
        drawn.append(info["opponent"])
        ended = False
        while not ended:
            _, _, terminated, truncated, info = stats.step(np.zeros(7))
            ended = terminated or truncated
    assert info["episode"]["l"] == 5
    assert set(drawn) == {0, 1}
    assert (first.games, second.games) == (drawn.count(0), drawn.count(1))
    assert first.steps + second.steps == 12 * 5
    env.opponents.append(late)
    assert env.reset(options={"opponent": 2})[1]["opponent"] == 2
    assert late.games == 1


def test_random_side_is_drawn_per_game() -> None:
    env = SelfPlayEnv([hold], side="random")
    sides = {env.reset(seed=0 if game == 0 else None)[1]["side"] for game in range(12)}
    assert sides == set(AGENTS)


# --- SuperSuit ---------------------------------------------------------------------------------------------------


def test_supersuit_makes_a_vector_environment_of_both_robots() -> None:
    supersuit = pytest.importorskip("supersuit")
    envs = supersuit.pettingzoo_env_to_vec_env_v1(AirHockeyGame(max_steps=20))
    observations, _ = envs.reset(seed=3)
    assert observations.shape == (2, 23)
    for _ in range(50):
        observations, rewards, terminated, truncated, _ = envs.step(np.zeros((2, 7), np.float32))
        assert observations.shape == (2, 23)
        assert truncated[0] == truncated[1]


@pytest.mark.parametrize("processes", [1, 2])
def test_supersuit_joins_games_in_processes(processes: int) -> None:
    supersuit = pytest.importorskip("supersuit")
    envs = supersuit.pettingzoo_env_to_vec_env_v1(AirHockeyGame(max_steps=20))
    envs = supersuit.concat_vec_envs_v1(envs, 4, num_cpus=processes, base_class="gymnasium")
    observations, _ = envs.reset(seed=3)
    assert observations.shape == (8, 23)
    ends = 0
    for _ in range(30):
        observations, _, _, truncated, _ = envs.step(np.zeros((8, 7), np.float32))
        ends += int(truncated.sum())
    assert ends == 8
    # Games of other seeds differ.
    assert len(np.unique(observations[0::2, 0])) > 1
    envs.close()
