"""Many games stepped together by threads, for Gymnasium: the learner plays both sides, or one against a pool."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import deepcopy
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.vector import VectorEnv
from gymnasium.vector.utils import batch_space

from faceoff._arguments import flag, integer, known_names, mask, numbers, one_of
from faceoff.errors import ArgumentError, ArgumentTypeError
from faceoff.game.batch import GAME_ARGUMENTS, GameArguments, GameBatch, agent_of
from faceoff.game.render import draw_game
from faceoff.game.self_play import check_pool, draw_opponent, read_pool
from faceoff.game.transition import AGENTS, Observation
from faceoff.gym.call_guard import CallGuard, exclusive
from faceoff.gym.spaces import game_observation_space
from faceoff.gym.vector import AutoresetMode, available_cpus, read_autoreset_mode, read_seeds

#: From observations, (k, 23) float32 of k games, each from the opponent's own side, to actions, (k, n).
BatchOpponent = Callable[[Observation], Any]
Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]
Step = tuple[Observation, Floats, Bools, Bools, dict[str, Any]]


class _GameVectorEnv(VectorEnv[Any, Any, Any]):
    """What both environments share. A *row* of their observations, actions and infos is one robot in one game.

    A game ends after ``max_steps`` (truncated), or when a robot's commands make the world diverge: terminated for that
    robot, truncated for the other.
    """

    #: [rows] the game of each row.
    _game_of: npt.NDArray[np.int64]
    #: [rows] the robot of each row, 0 or 1.
    _robot_of: npt.NDArray[np.int64]

    def _init_games(
        self,
        games: int,
        *,
        max_steps: int,
        autoreset_mode: AutoresetMode | str,
        copy: bool,
        threads: int | None,
        render_mode: str | None,
        game_arguments: Mapping[str, Any],
    ) -> None:
        known_names(type(self).__name__, game_arguments, GAME_ARGUMENTS)
        self._arguments = GameArguments.read(max_steps=max_steps, ends_at_divergence=True, **game_arguments)
        self.autoreset_mode = read_autoreset_mode(autoreset_mode)
        if render_mode is not None:
            one_of("render_mode", render_mode, ["rgb_array"])
        # A step of one game is enough work for a thread.
        count = min(available_cpus(), games) if threads is None else integer("threads", threads, 1, 1024)
        self.copy = flag("copy", copy)
        self.render_mode = render_mode
        self.metadata = {
            "render_modes": ["rgb_array"],
            "render_fps": 50,
            "autoreset_mode": self.autoreset_mode,
        }
        mode = self.autoreset_mode.name.lower()
        self._batch = GameBatch(self._arguments, games, threads=count, autoreset=mode)
        self._calls = CallGuard()
        self._seeds = np.zeros(games, np.int64)

    def _init_spaces(self, action_space: Any) -> None:
        self.single_observation_space = game_observation_space()
        self.single_action_space = action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    def _rows_of(self, observations: Observation) -> Observation:
        """The rows (num_envs, 23) of observations of both robots, (games, 2, 23)."""
        raise NotImplementedError

    def _check(self) -> None:
        """Refuses a pool that cannot play. Called before a step or reset, so that a refusal changes nothing."""

    def _games_begin(self, games: Bools, numbers_of_games: npt.NDArray[np.int64]) -> dict[str, Any]:
        """Called when games begin; returns infos about them, without masks."""
        return {}

    def _actions_of_both(self, actions: Any) -> Sequence[Floats]:
        """The actions of robot 1 and of robot 2 in all games, (games, n) each, from those of the rows."""
        raise NotImplementedError

    # --- reset -------------------------------------------------------------------------------------------------

    @exclusive
    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observation, dict[str, Any]]:
        """Begins every game, or those of ``options["reset_mask"]``, an array of bool with one element per game.

        Args:
            seed: s for seeds s, s + 1, … of the games; or a sequence with one per game, None to continue with the next
                game of its seed.
            options: ``reset_mask``.
        """
        batch = self._batch
        is_started = batch.is_started
        self._check()
        is_reset = self._read_mask(options)
        seeds = read_seeds(seed, batch.games, "games")
        super().reset(seed=seeds[0] if np.ndim(seed) == 0 else None)  # type: ignore[arg-type]
        if not is_started:
            fallback = self.np_random.integers(2**63, size=batch.games).tolist()
            seeds = [new if given is None else given for given, new in zip(seeds, fallback, strict=True)]
        batch.reset(is_reset, seeds)
        origins = np.array(batch.native.origins(), np.uint64).astype(np.int64)
        self._seeds = origins[:, 0].copy()
        infos = self._start_infos(is_reset, origins[:, 1])
        return self._returned_observations(batch.results.observations), infos

    def _returned_observations(self, observations: Observation) -> Observation:
        rows = self._rows_of(observations)
        return rows.copy() if self.copy else rows

    def _read_mask(self, options: object) -> Bools:
        if options is None:
            return np.ones(self._batch.games, np.bool_)
        if not isinstance(options, Mapping):
            raise ArgumentTypeError(f"options: expected a mapping with reset_mask, got {options!r:.80}")
        unknown = [name for name in options if name != "reset_mask"]
        if unknown:
            raise ArgumentError(f"options: expected reset_mask, got {unknown[0]!r}")
        if options.get("reset_mask") is None:
            return np.ones(self._batch.games, np.bool_)
        return mask("options['reset_mask']", options["reset_mask"], self._batch.games)

    def _start_infos(self, begun: Bools, numbers_of_games: npt.NDArray[np.int64]) -> dict[str, Any]:
        values = {"seed": self._seeds, "game_number": numbers_of_games, **self._games_begin(begun, numbers_of_games)}
        begun_rows = begun[self._game_of]
        infos: dict[str, Any] = {}
        for name, value in values.items():
            of_rows = value[self._game_of]
            is_whole = of_rows.dtype.kind in "iu"
            infos[name] = np.where(begun_rows, of_rows, 0) if is_whole else np.where(begun_rows, of_rows, None)
            infos[f"_{name}"] = begun_rows.copy()
        return infos

    # --- step --------------------------------------------------------------------------------------------------

    @exclusive
    def step(self, actions: Any) -> Step:
        """One control step of every game, 20 ms.

        Infos are arrays, each with a mask: ``constraints``, ``score``, ``goals`` and ``fouls`` (robot 1 first),
        ``rally_end`` and ``rally_end_by`` where a rally has ended, ``seed`` and ``game_number`` where a game has begun.
        """
        batch = self._batch
        batch.native  # noqa: B018 - the error about a closed environment comes first
        self._check()
        batch.step(self._actions_of_both(actions))
        results = batch.results
        is_over, is_new = results.is_over, results.steps == 0
        diverged = results.diverged[self._game_of, self._robot_of]
        terminated = diverged & is_over[self._game_of]
        truncated = is_over[self._game_of] & ~terminated
        rewards = results.rewards[self._game_of, self._robot_of]
        has_step = ~is_new
        infos: dict[str, Any] = {}
        if self.autoreset_mode.name == "SAME_STEP" and is_over.any():
            ended = is_over[self._game_of]
            finals = np.full(self.num_envs, None, object)
            final_rows = self._rows_of(results.final_observations)
            for row in np.flatnonzero(ended):
                finals[row] = final_rows[row].copy()
            infos["final_obs"], infos["_final_obs"] = finals, ended.copy()
            infos["final_info"], infos["_final_info"] = self._step_infos(is_over), ended.copy()
            has_step &= ~is_over
        infos |= self._step_infos(has_step)
        # The side and the opponent of a new game are drawn now, so its observations are taken afterwards.
        begun = is_new | is_over if self.autoreset_mode.name == "SAME_STEP" else is_new
        if begun.any():
            # At its end a game's number is that of the ended one.
            infos |= self._start_infos(begun, results.numbers + (is_over & begun))
        return self._returned_observations(results.observations), rewards, terminated, truncated, infos

    def _step_infos(self, games: Bools) -> dict[str, Any]:
        results = self._batch.results
        present = games[self._game_of]
        infos: dict[str, Any] = {}
        if not present.any():
            return infos
        values = {
            "constraints": results.constraints[self._game_of, self._robot_of],
            "score": results.score[self._game_of],
            "goals": results.goals[self._game_of],
            "fouls": results.fouls[self._game_of],
        }
        for name, value in values.items():
            value[~present] = 0
            infos[name], infos[f"_{name}"] = value, present.copy()
        ended = results.rally_ended & games
        if ended.any():
            ends, by = results.rally_ends, results.by
            reasons, names = np.full((2, self.num_envs), None, object)
            of_rows = ended[self._game_of]
            for row in np.flatnonzero(of_rows):
                game = self._game_of[row]
                reasons[row], names[row] = ends[game], agent_of(int(by[game]))
            infos |= {"rally_end": reasons, "rally_end_by": names}
            infos |= {"_rally_end": of_rows, "_rally_end_by": of_rows.copy()}
        return infos

    def render(self) -> tuple[npt.NDArray[np.uint8], ...]:  # type: ignore[override]
        """A picture of the table of each row's game, (360, 640, 3) uint8."""
        if self.render_mode is None:
            raise ArgumentError("render: expected an environment made with render_mode='rgb_array', got None")
        native = self._batch.native
        frames = [draw_game(native.state(game)) for game in range(self._batch.games)]
        return tuple(frames[game] for game in self._game_of)

    def __copy__(self) -> _GameVectorEnv:
        # Opponents are functions: copies share them, not the list.
        shared = [*getattr(self, "opponents", []), *getattr(self, "_opponent_of", [])]
        return deepcopy(self, {id(opponent): opponent for opponent in shared})

    def close_extras(self, **kwargs: Any) -> None:
        """Releases games and threads; called by ``close``."""
        if hasattr(self, "_batch"):
            self._batch.close()


class AirHockeyGameVectorEnv(_GameVectorEnv):
    """Many games, in which the learner plays both sides: 2 × ``games`` rows of observations and actions.

    Row 2i is robot 1 of game i, row 2i + 1 robot 2, each observed from its own side. Game i after ``reset(seed=s)``
    equals an :class:`AirHockeyGame` after ``reset(seed=s + i)`` bit for bit, until a robot makes the world diverge.

    Args:
        games: number of games.
        max_steps: control steps of a game; the default is one minute.
        autoreset_mode: as for :class:`faceoff.gym.AirHockeyVectorEnv`; both rows of a game end together.
        copy: whether each step returns new observations. Otherwise they may be the same memory each time, overwritten by
            the next step or reset.
        threads: threads of this environment's pool; by default one per CPU that this process may use. Results do not
            depend on it.
        render_mode: ``rgb_array`` or None.
        game_arguments: as for :class:`AirHockeyGame`; both robots must have the same action space. ``reward`` gets a
            :class:`GameTransition` of all games, and returns an array of shape (games, 2).
    """

    def __init__(
        self,
        games: int = 1,
        *,
        max_steps: int = 3_000,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        threads: int | None = None,
        render_mode: str | None = None,
        **game_arguments: Any,
    ) -> None:
        count = integer("games", games, 1, 500_000)
        self.num_envs = 2 * count
        self._init_games(
            count,
            max_steps=max_steps,
            autoreset_mode=autoreset_mode,
            copy=copy,
            threads=threads,
            render_mode=render_mode,
            game_arguments=game_arguments,
        )
        first, second = self._arguments.action_spaces()
        if first != second:
            raise ArgumentError(
                "interpolation, action_mode: expected the same for both robots, whose rows share an action space, "
                "got two: use SelfPlayVectorEnv"
            )
        self._init_spaces(first)
        self._game_of = np.repeat(np.arange(count), 2)
        self._robot_of = np.tile(np.arange(2), count)

    def _rows_of(self, observations: Observation) -> Observation:
        return observations.reshape(-1, observations.shape[-1])

    def _actions_of_both(self, actions: Any) -> Sequence[Floats]:
        checked = numbers("actions", actions, self.action_space.shape)  # type: ignore[arg-type]
        return [np.ascontiguousarray(checked[0::2]), np.ascontiguousarray(checked[1::2])]


class SelfPlayVectorEnv(_GameVectorEnv):
    """One side of many games, each against an opponent drawn from a pool when the game begins.

    Args:
        num_envs: number of games.
        opponents: functions from observations, (k, 23) float32 of the k games in which they play, each from their own
            side, to actions, (k, n). A method ``reset(games)``, if there is one, is called with the indices of the games
            that begin.
        side: ``robot_1``, ``robot_2``, or ``random`` to draw the side of each game.
        max_steps, autoreset_mode, copy, threads, render_mode, game_arguments: as for
            :class:`AirHockeyGameVectorEnv`; with a fixed side the robots may have different action spaces.

    Opponent and random side of a game follow from its seed and number, and stay until its end. The pool may change during
    training: ``env.unwrapped.opponents.append(policy)`` takes effect in games that begin later. Infos of a new game have
    ``opponent`` and ``side``.
    """

    def __init__(
        self,
        num_envs: int = 1,
        opponents: Iterable[BatchOpponent] = (),
        *,
        side: str = "robot_1",
        max_steps: int = 3_000,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        threads: int | None = None,
        render_mode: str | None = None,
        **game_arguments: Any,
    ) -> None:
        self.num_envs = integer("num_envs", num_envs, 1, 1_000_000)
        self.opponents: list[BatchOpponent] = read_pool(opponents)
        self._side = one_of("side", side, [*AGENTS, "random"])
        self._init_games(
            self.num_envs,
            max_steps=max_steps,
            autoreset_mode=autoreset_mode,
            copy=copy,
            threads=threads,
            render_mode=render_mode,
            game_arguments=game_arguments,
        )
        spaces = self._arguments.action_spaces()
        if side == "random" and spaces[0] != spaces[1]:
            raise ArgumentError("side: expected robot_1 or robot_2, since their actions differ, got random")
        own = 0 if side == "random" else AGENTS.index(side)
        self._init_spaces(spaces[own])
        self._action_lens = [space.shape[0] for space in spaces]
        self._game_of = np.arange(self.num_envs)
        self._robot_of = np.full(self.num_envs, own)
        #: The opponent of each game, from its begin to its end, whatever happens to the pool; and its index then.
        self._opponent_of = np.full(self.num_envs, self.opponents[0], object)
        self._index_of = np.zeros(self.num_envs, np.int64)

    def _check(self) -> None:
        check_pool(self.opponents)

    def _games_begin(self, games: Bools, numbers_of_games: npt.NDArray[np.int64]) -> dict[str, Any]:
        begun = np.flatnonzero(games)
        for game in begun:
            drawn = draw_opponent(int(self._seeds[game]), int(numbers_of_games[game]), len(self.opponents))
            self._index_of[game], robot = drawn
            self._opponent_of[game] = self.opponents[drawn[0]]
            if self._side == "random":
                self._robot_of[game] = robot
        for opponent, own in self._by_opponent(begun):
            reset = getattr(opponent, "reset", None)
            if reset is not None:
                reset(own)
        return {"opponent": self._index_of, "side": np.array(AGENTS, object)[self._robot_of]}

    def _by_opponent(self, games: npt.NDArray[np.int64]) -> list[tuple[BatchOpponent, npt.NDArray[np.int64]]]:
        """The games of each opponent among these, in the order of their first game."""
        groups: dict[int, list[int]] = {}
        for game in games.tolist():
            groups.setdefault(id(self._opponent_of[game]), []).append(game)
        return [(self._opponent_of[group[0]], np.array(group)) for group in groups.values()]

    def _rows_of(self, observations: Observation) -> Observation:
        if self._side == "random":
            return observations[self._game_of, self._robot_of]
        # A view instead of a copy: all rows are the same robot.
        return observations[:, self._robot_of[0]]

    def _actions_of_both(self, actions: Any) -> Sequence[Floats]:
        checked = numbers("actions", actions, self.action_space.shape)  # type: ignore[arg-type]
        results = self._batch.results
        # In this step the next game begins where one is over, without actions.
        begins = results.is_over & (self.autoreset_mode.name == "NEXT_STEP")
        of_robots = [np.zeros((self.num_envs, length)) for length in self._action_lens]
        for robot, of_robot in enumerate(of_robots):
            own = self._robot_of == robot
            if own.any():
                of_robot[own] = checked[own]
            for opponent, games in self._by_opponent(np.flatnonzero(~own & ~begins)):
                name = f"actions of opponents[{self._index_of[games[0]]}]"
                of_robot[games] = numbers(name, opponent(results.observations[games, robot]), (len(games), of_robot.shape[1]))
        return of_robots
