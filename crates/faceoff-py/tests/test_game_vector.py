"""Many games at once: they equal single games, in every mode, for both sides or against a pool."""

from __future__ import annotations

import copy
import pickle
import threading
from collections.abc import Callable
from typing import Any

import faceoff
import numpy as np
import pytest
from commands import runaway_action
from faceoff.game import AirHockeyGame, AirHockeyGameVectorEnv, GameTransition, SelfPlayEnv, SelfPlayVectorEnv
from gymnasium.wrappers.vector import RecordEpisodeStatistics

MODES = ["NextStep", "SameStep", "Disabled"]


def hold(observations: np.ndarray) -> np.ndarray:
    return np.zeros((len(observations), 7))


def random_actions(rows: int, steps: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(-1.0, 1.0, (steps, rows, 7))


# --- equality with single games ----------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("threads", [1, 3])
def test_games_equal_single_games_to_the_bit(mode: str, threads: int) -> None:
    games, length = 3, 25
    envs = AirHockeyGameVectorEnv(
        games, max_steps=length, profile="evaluation", autoreset_mode=mode, threads=threads
    )
    singles = [AirHockeyGame(max_steps=length, profile="evaluation") for _ in range(games)]
    observations, infos = envs.reset(seed=10)
    assert infos["seed"].tolist() == [10, 10, 11, 11, 12, 12]
    expected = [single.reset(seed=10 + index)[0] for index, single in enumerate(singles)]
    fresh = np.zeros(games, np.bool_)
    for actions in random_actions(2 * games, 4 * length):
        assert_rows_equal(observations, expected)
        if mode == "Disabled" and fresh.all():
            observations, infos = envs.reset(options={"reset_mask": fresh})
            assert infos["game_number"].tolist() == [singles[0]._batch.results.numbers[0] + 1] * 6
            expected = [single.reset()[0] for single in singles]
            fresh[:] = False
            continue
        observations, rewards, terminated, truncated, infos = envs.step(actions)
        assert not terminated.any()
        for index, single in enumerate(singles):
            rows = slice(2 * index, 2 * index + 2)
            if fresh[index] and mode == "NextStep":
                expected[index] = single.reset()[0]
                assert rewards[rows].tolist() == [0.0, 0.0]
                fresh[index] = False
                continue
            own = dict(zip(("robot_1", "robot_2"), actions[rows], strict=True))
            expected[index], reward, _, truncations, info = single.step(own)
            assert rewards[rows].tolist() == list(reward.values())
            assert truncated[rows].tolist() == list(truncations.values())
            row_infos = infos
            if truncations["robot_1"] and mode == "SameStep":
                row_infos = infos["final_info"]
                np.testing.assert_array_equal(infos["final_obs"][2 * index], expected[index]["robot_1"])
                expected[index] = single.reset()[0]
            elif truncations["robot_1"]:
                fresh[index] = True
            np.testing.assert_array_equal(row_infos["constraints"][2 * index + 1], info["robot_2"]["constraints"])
            assert tuple(row_infos["score"][2 * index]) == info["robot_1"]["score"]


def assert_rows_equal(observations: np.ndarray, singles: list[dict[str, np.ndarray]]) -> None:
    """The rows of many games are the observations of both robots in the single games, game by game."""
    both = [observation for single in singles for observation in single.values()]
    np.testing.assert_array_equal(observations, both)


def test_ends_of_rallies_are_in_the_infos_of_both_rows() -> None:
    envs = AirHockeyGameVectorEnv(2, max_steps=2_000)
    envs.reset(seed=1)
    zeros = np.zeros((4, 7))
    for _ in range(800):
        *_, infos = envs.step(zeros)
        if "rally_end" in infos:
            break
    ended = infos["_rally_end"]
    assert ended[0::2].tolist() == ended[1::2].tolist()
    assert set(infos["rally_end"][ended]) == {"foul"}
    assert set(infos["rally_end_by"][ended]) <= {"robot_1", "robot_2"}
    assert infos["fouls"][ended].sum(axis=1).tolist() == [1] * int(ended.sum())


def test_divergence_ends_the_game_for_both_rows() -> None:
    envs = AirHockeyGameVectorEnv(2, interpolation=None, action_mode="raw", max_steps=1_500, autoreset_mode="SameStep")
    observations, _ = envs.reset(seed=1)
    still = np.tile(np.concatenate([observations[0, 6:13], np.zeros(14)]), 20)
    for _ in range(1_400):
        actions = np.tile(still, (4, 1))
        actions[0] = runaway_action(*np.split(observations[0, 6:20], 2))
        observations, rewards, terminated, truncated, infos = envs.step(actions)
        if terminated.any():
            break
    assert terminated.tolist() == [True, False, False, False]
    assert truncated.tolist() == [False, True, False, False]
    assert rewards[0] == -10.0
    assert infos["_final_info"].tolist() == [True, True, False, False]
    assert infos["game_number"].tolist() == [1, 1, 0, 0]


def test_reward_function_gets_all_games() -> None:
    shapes = []

    def reward(transition: GameTransition) -> Any:
        arrays = (transition.observations, transition.puck, transition.robots, transition.constraints, transition.by)
        shapes.append([array.shape for array in arrays])
        return transition.next_observations[:, :, 0] - transition.observations[:, :, 0]

    envs = AirHockeyGameVectorEnv(3, reward=reward, copy=False)
    before, _ = envs.reset(seed=1)
    before = before.copy()
    after, rewards, *_ = envs.step(np.full((6, 7), 0.5))
    np.testing.assert_array_equal(rewards, (after[:, 0] - before[:, 0]).astype(np.float64))
    assert shapes == [[(3, 2, 23), (3, 6), (3, 2, 17), (3, 2, 4), (3,)]]


def test_without_copies_observations_are_one_array() -> None:
    kept = AirHockeyGameVectorEnv(2)
    reused = AirHockeyGameVectorEnv(2, copy=False)
    first, _ = kept.reset(seed=1)
    same, _ = reused.reset(seed=1)
    second, *_ = kept.step(np.ones((4, 7)))
    again, *_ = reused.step(np.ones((4, 7)))
    assert np.shares_memory(same, again)
    assert not np.shares_memory(first, second)
    np.testing.assert_array_equal(second, again)


# --- copies ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("clone", [copy.copy, copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_copy_of_a_game_continues_with_the_same_bits(clone: Callable[[Any], Any]) -> None:
    game = AirHockeyGame(profile="evaluation", max_steps=1_600)
    game.reset(seed=4)
    actions = random_actions(2, 1_600)
    pairs = [dict(zip(game.possible_agents, pair, strict=True)) for pair in actions]
    rallies = 0
    for step, pair in enumerate(pairs[:900]):
        *_, infos = game.step(pair)
        rallies += "rally_end" in infos["robot_1"]
    assert rallies > 0
    twin = clone(game)
    for pair in pairs[900:]:
        expected, got = game.step(pair), twin.step(pair)
        np.testing.assert_array_equal(got[0]["robot_2"], expected[0]["robot_2"])
        assert got[1:4] == expected[1:4]
        assert got[4]["robot_1"]["score"] == expected[4]["robot_1"]["score"]
    assert twin.agents == game.agents == []
    np.testing.assert_array_equal(twin.reset()[0]["robot_1"], game.reset()[0]["robot_1"])


@pytest.mark.parametrize("clone", [copy.copy, copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_copy_of_many_games_continues_with_the_same_bits(clone: Callable[[Any], Any]) -> None:
    envs = SelfPlayVectorEnv(3, [hold, hold], side="random", max_steps=40, profile="evaluation")
    envs.reset(seed=4)
    for actions in random_actions(3, 60):
        envs.step(actions)
    twin = clone(envs)
    for actions in random_actions(3, 100):
        expected, got = envs.step(actions), twin.step(actions)
        for one, other in zip(got[:4], expected[:4], strict=True):
            np.testing.assert_array_equal(one, other)


def test_copy_with_a_robot_out_of_the_game_continues() -> None:
    game = AirHockeyGame(interpolation=(None, 1), action_mode=("raw", "delta"))
    observations, _ = game.reset(seed=1)
    while "robot_1" in game.agents:
        actions = {"robot_1": runaway_action(*np.split(observations["robot_1"][6:20], 2)), "robot_2": np.zeros(7)}
        observations, *_ = game.step(actions)
    for _ in range(5):
        game.step({"robot_2": np.full(7, 0.3)})
    twin = pickle.loads(pickle.dumps(game))
    expected, got = game.step({"robot_2": np.zeros(7)}), twin.step({"robot_2": np.zeros(7)})
    np.testing.assert_array_equal(got[0]["robot_2"], expected[0]["robot_2"])


def test_copies_of_new_and_closed_games_are_new_and_closed() -> None:
    new = pickle.loads(pickle.dumps(AirHockeyGame()))
    assert new.reset(seed=1)[0]["robot_1"].shape == (23,)
    new.close()
    closed = copy.deepcopy(new)
    with pytest.raises(faceoff.ClosedError):
        closed.reset(seed=1)


def test_damaged_state_of_a_game_is_refused() -> None:
    game = AirHockeyGame()
    game.reset(seed=1)
    game.step({agent: np.zeros(7) for agent in game.agents})
    data = game._batch.native.save(0).__reduce__()[1][0]
    for damaged, message in [
        (b"{", "state: expected a game pickled by faceoff"),
        (data.replace(b'"faceoff":"', b'"faceoff":"9'), "state: expected one pickled by this version"),
        (data.replace(b'"serving_robot":', b'"serving_robot":7'), "state: expected a serving robot of 0 or 1"),
        (data.replace(b'"actions":[', b'"actions":[0.0,'), "state: expected actions of 14 numbers each"),
        (data.replace(b'"actions":[0.0', b'"actions":[5.0'), "action: expected numbers from -1 to 1, got 5"),
    ]:
        assert damaged != data
        with pytest.raises(faceoff.ArgumentError, match=message):
            faceoff._native.load_game(damaged)


# --- opponents ---------------------------------------------------------------------------------------------------


class CountingOpponent:
    """An opponent that records the games it starts, and counts the rows of observations that it gets."""

    def __init__(self) -> None:
        self.started_games: list[int] = []
        self.rows = 0

    def reset(self, games: np.ndarray) -> None:
        self.started_games += games.tolist()

    def __call__(self, observations: np.ndarray) -> np.ndarray:
        assert observations.shape[1] == 23
        self.rows += len(observations)
        return np.zeros((len(observations), 7), np.float32)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_each_game_is_played_against_one_opponent_of_the_pool(mode: str) -> None:
    first, second = CountingOpponent(), CountingOpponent()
    envs = SelfPlayVectorEnv(8, [first, second], max_steps=10, autoreset_mode=mode)
    _, infos = envs.reset(seed=2)
    assert set(infos["opponent"]) == {0, 1}
    late = CountingOpponent()
    envs.opponents.append(late)
    for actions in random_actions(8, 44):
        envs.step(actions)
    games = len(first.started_games) + len(second.started_games) + len(late.started_games)
    # In 44 steps four games end; with NextStep each takes a step more, in which the next one begins.
    assert games == 8 * 5
    assert late.started_games
    assert sorted(set(first.started_games + second.started_games + late.started_games)) == list(range(8))


def test_opponent_and_side_follow_from_seed_and_number() -> None:
    pool = [hold] * 50

    def drawn(infos: dict[str, Any]) -> list[tuple[int, str]]:
        return list(zip(infos["opponent"].tolist(), infos["side"].tolist(), strict=True))

    envs = SelfPlayVectorEnv(8, pool, side="random", max_steps=3, autoreset_mode="Disabled")
    first = drawn(envs.reset(seed=3)[1])
    assert drawn(SelfPlayVectorEnv(8, pool, side="random").reset(seed=range(3, 11))[1]) == first
    second = drawn(envs.reset()[1])
    assert second != first
    single = SelfPlayEnv(pool, side="random")
    for index in range(8):
        infos = [single.reset(seed=np.int64(3 + index))[1], single.reset()[1]]  # type: ignore[arg-type]
        assert [(info["opponent"], info["side"]) for info in infos] == [first[index], second[index]]
    mask = np.arange(8) == 5
    assert drawn(envs.reset(seed=[3 + index for index in range(8)], options={"reset_mask": mask})[1])[5] == first[5]


def test_games_keep_their_opponent_while_the_pool_changes() -> None:
    old, new = CountingOpponent(), CountingOpponent()
    envs = SelfPlayVectorEnv(3, [old, old], max_steps=4, autoreset_mode="SameStep")
    envs.reset(seed=1)
    envs.opponents[:] = [new]
    for _ in range(4):
        assert new.rows == 0
        envs.step(np.zeros((3, 7)))
    envs.step(np.zeros((3, 7)))
    assert (old.rows, new.rows) == (12, 3)


def test_invalid_pool_is_refused_before_the_step() -> None:
    envs = SelfPlayVectorEnv(2, [hold], max_steps=2, autoreset_mode="SameStep")
    envs.reset(seed=1)
    envs.step(np.zeros((2, 7)))
    envs.opponents.append(3)  # type: ignore[arg-type]
    with pytest.raises(faceoff.ArgumentTypeError, match=r"opponents\[1\]"):
        envs.step(np.zeros((2, 7)))
    envs.opponents.pop()
    *_, truncated, infos = envs.step(np.zeros((2, 7)))
    assert truncated.all() and infos["_final_info"].all()


def test_opponents_play_no_game_that_is_over() -> None:
    class LoggingOpponent(CountingOpponent):
        def __call__(self, observations: np.ndarray) -> np.ndarray:
            calls.append("act")
            return super().__call__(observations)

        def reset(self, games: np.ndarray) -> None:
            calls.append("reset")

    calls: list[str] = []
    envs = SelfPlayVectorEnv(1, [LoggingOpponent()], max_steps=2)
    envs.reset(seed=1)
    for _ in range(4):
        envs.step(np.zeros((1, 7)))
    assert calls == ["reset", "act", "act", "reset", "act"]


def test_returned_observations_may_be_changed() -> None:
    seen: list[np.ndarray] = []

    def reward(transition: GameTransition) -> np.ndarray:
        seen.append(transition.observations.copy())
        return np.zeros((2, 2))

    envs = AirHockeyGameVectorEnv(2, reward=reward, autoreset_mode="Disabled")
    observations, _ = envs.reset(seed=1)
    kept = observations.copy()
    observations *= 0.0
    envs.step(np.zeros((4, 7)))
    np.testing.assert_array_equal(seen[0].reshape(4, 23), kept)


@pytest.mark.parametrize("side", ["robot_1", "robot_2", "random"])
def test_own_side_equals_the_row_of_both_sides(side: str) -> None:
    envs = SelfPlayVectorEnv(4, [lambda observations: np.full((len(observations), 7), 0.2)], side=side)
    both = AirHockeyGameVectorEnv(4)
    own, infos = envs.reset(seed=7)
    robots = np.array([["robot_1", "robot_2"].index(name) for name in infos["side"]])
    rows = 2 * np.arange(4) + robots
    np.testing.assert_array_equal(own, both.reset(seed=7)[0][rows])
    for actions in random_actions(4, 50):
        all_actions = np.full((8, 7), 0.2)
        all_actions[rows] = actions
        expected = both.step(all_actions)
        got = envs.step(actions)
        np.testing.assert_array_equal(got[0], expected[0][rows])
        np.testing.assert_array_equal(got[4]["constraints"], expected[4]["constraints"][rows])
    if side == "random":
        assert set(robots) == {0, 1}


def test_robots_of_a_fixed_side_may_have_other_actions() -> None:
    envs = SelfPlayVectorEnv(
        2, [lambda rows: np.zeros((len(rows), 14))], side="robot_1", interpolation=(1, 3), action_mode="delta"
    )
    envs.reset(seed=1)
    assert envs.single_action_space.shape == (7,)
    envs.step(np.zeros((2, 7)))


def test_statistics_and_pictures_work() -> None:
    envs = SelfPlayVectorEnv(2, [hold], max_steps=5, render_mode="rgb_array", autoreset_mode="SameStep")
    recorded = RecordEpisodeStatistics(envs)
    recorded.reset(seed=1)
    for _ in range(5):
        *_, infos = recorded.step(np.zeros((2, 7)))
    assert infos["episode"]["l"].tolist() == [5, 5]
    assert [frame.shape for frame in recorded.render()] == [(360, 640, 3)] * 2
    assert recorded.metadata["render_fps"] == 50


# --- errors ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: AirHockeyGameVectorEnv(0), "games: expected a whole number from 1 to 500000, got 0"),
        (lambda: AirHockeyGameVectorEnv(2, max_steps=0), "max_steps: expected a whole number from 1 to 1000000, got 0"),
        (lambda: AirHockeyGameVectorEnv(2, profil="ideal"), "AirHockeyGameVectorEnv: expected arguments among .*, got profil"),
        (lambda: AirHockeyGameVectorEnv(2, interpolation=(1, 3)), "interpolation, action_mode: expected the same for both"),
        (lambda: AirHockeyGameVectorEnv(2, interpolation=(1, 3, 5)), "interpolation: expected one for both robots or a pair"),
        (lambda: AirHockeyGameVectorEnv(2, autoreset_mode="Never"), "autoreset_mode: expected one of NextStep"),
        (lambda: AirHockeyGameVectorEnv(2, copy="no"), "copy: expected True or False, got 'no'"),
        (lambda: AirHockeyGameVectorEnv(2, threads=0), "threads: expected a whole number from 1"),
        (lambda: AirHockeyGameVectorEnv(2, render_mode="human"), "render_mode: expected one of rgb_array"),
        (lambda: AirHockeyGameVectorEnv(2, reward=3), "reward: expected a function of a GameTransition, got 3"),
        (lambda: SelfPlayVectorEnv(2), "opponents: expected at least one, got none"),
        (lambda: SelfPlayVectorEnv(2, hold), "opponents: expected a list of functions, got <function hold"),
        (lambda: SelfPlayVectorEnv(2, [hold, 3]), r"opponents\[1\]: expected a function .*, got 3"),
        (lambda: SelfPlayVectorEnv(2, [hold], side="left"), "side: expected one of robot_1, robot_2, random, got 'left'"),
        (
            lambda: SelfPlayVectorEnv(2, [hold], side="random", interpolation=(1, 3)),
            "side: expected robot_1 or robot_2, since their actions differ, got random",
        ),
    ],
)
def test_invalid_argument_is_named(make: Callable[[], object], message: str) -> None:
    with pytest.raises(faceoff.Error, match=message):
        make()


def test_invalid_calls_are_refused() -> None:
    envs = AirHockeyGameVectorEnv(2, max_steps=2, autoreset_mode="Disabled")
    with pytest.raises(faceoff.OrderError, match="expected reset"):
        envs.step(np.zeros((4, 7)))
    with pytest.raises(faceoff.ArgumentError, match="seed: expected one for each of 2 games, got 3"):
        envs.reset(seed=[1, 2, 3])
    with pytest.raises(faceoff.ArgumentError, match="options: expected reset_mask, got 'puck'"):
        envs.reset(options={"puck": 1})
    envs.reset(seed=1)
    with pytest.raises(faceoff.ArgumentError, match=r"actions: expected an array of shape \(4, 7\)"):
        envs.step(np.zeros((2, 7)))
    bad = np.zeros((4, 7))
    bad[3, 2] = np.nan
    with pytest.raises(faceoff.ArgumentError, match="finite numbers, got NaN at index 2 of robot_2 in game 1"):
        envs.step(bad)
    for _ in range(2):
        envs.step(np.zeros((4, 7)))
    with pytest.raises(faceoff.OrderError, match="but game 0 has ended"):
        envs.step(np.zeros((4, 7)))
    envs.close()
    with pytest.raises(faceoff.ClosedError):
        envs.step(np.zeros((4, 7)))


def test_wrong_answer_of_an_opponent_is_named() -> None:
    envs = SelfPlayVectorEnv(2, [lambda observations: np.zeros(7)])
    envs.reset(seed=1)
    message = r"actions of opponents\[0\]: expected an array of shape \(2, 7\), got one of shape \(7,\)"
    with pytest.raises(faceoff.ArgumentError, match=message):
        envs.step(np.zeros((2, 7)))


@pytest.mark.parametrize("value", [np.zeros(3), "abc", None, {}, 1j, [[1], [2, 3]], [10**400, 0], np.full((3, 2), np.nan)])
def test_reward_that_is_no_array_of_numbers_is_refused(value: Any) -> None:
    envs = AirHockeyGameVectorEnv(3, reward=lambda transition: value)
    envs.reset(seed=1)
    with pytest.raises(faceoff.Error, match=r"reward: expected a function that returns finite numbers of shape \(3, 2\)"):
        envs.step(np.zeros((6, 7)))
    game = AirHockeyGame(reward=lambda transition: value)
    game.reset(seed=1)
    with pytest.raises(faceoff.Error, match=r"reward: expected a function that returns finite numbers of shape \(2,\)"):
        game.step({agent: np.zeros(7) for agent in game.agents})


@pytest.mark.parametrize(
    ("options", "message"),
    [([1], "options: expected a mapping"), ({"oponent": 0}, "options: expected opponent, got 'oponent'")],
)
def test_options_of_self_play_are_checked(options: Any, message: str) -> None:
    with pytest.raises(faceoff.Error, match=message):
        SelfPlayEnv([hold]).reset(options=options)


def test_calls_of_two_threads_at_once_are_refused() -> None:
    game = AirHockeyGame(profile="evaluation")
    game.reset(seed=1)
    twin = copy.deepcopy(game)
    actions = {agent: np.zeros(7) for agent in game.agents}
    stop, refused = threading.Event(), []

    def disturb() -> None:
        while not stop.is_set():
            try:
                game.step({"robot_1": np.full(7, np.nan), "robot_2": np.zeros(7)})
            except faceoff.Error as error:
                refused.append(type(error))

    thread = threading.Thread(target=disturb)
    thread.start()
    try:
        for _ in range(500):
            try:
                got = game.step(actions)[0]
            except faceoff.OrderError:
                continue
            np.testing.assert_array_equal(got["robot_1"], twin.step(actions)[0]["robot_1"])
    finally:
        stop.set()
        thread.join()
    assert set(refused) <= {faceoff.ArgumentError, faceoff.OrderError}
