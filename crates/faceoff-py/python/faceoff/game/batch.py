"""Games stepped together by the native half (compiled from Rust), for all environments of `faceoff.game`."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from faceoff import _native
from faceoff._arguments import (
    ACTION_MODES,
    ActionMode,
    flag,
    integer,
    interpolation_code,
    mismatch_seed_text,
    one_of,
    perturbation_names,
    perturbations_json,
)
from faceoff.errors import ArgumentError, ArgumentTypeError, ClosedError
from faceoff.game.transition import AGENTS, GameReward, GameTransition, Observation, default_reward
from faceoff.gym.spaces import action_space

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

#: The longest game, control steps.
MOST_STEPS = 1_000_000
#: Arguments that every environment of games has.
GAME_ARGUMENTS = (
    "interpolation",
    "action_mode",
    "clip_actions",
    "profile",
    "perturbations",
    "mismatch_seed",
    "reward",
)
#: One value for both robots, or a pair.
Interpolations = int | None | tuple[int | None, int | None]
ActionModes = ActionMode | tuple[ActionMode, ActionMode]


@dataclass(frozen=True)
class GameArguments:
    """Checked arguments of a game. In pairs robot 1 comes first."""

    interpolations: tuple[int | None, int | None]
    action_modes: tuple[str, str]
    #: JSON for the native half.
    setup: str
    max_steps: int
    reward: GameReward

    @classmethod
    def read(
        cls,
        *,
        max_steps: int,
        interpolation: Interpolations = 1,
        action_mode: ActionModes = "delta",
        clip_actions: bool = False,
        profile: str | Sequence[str] = "ideal",
        perturbations: Mapping[str, Any] | None = None,
        mismatch_seed: int | str | None = None,
        reward: GameReward | None = None,
        ends_at_divergence: bool,
    ) -> GameArguments:
        """Checks the arguments of an environment."""
        steps = integer("max_steps", max_steps, 1, MOST_STEPS)
        first, second = _pair("interpolation", interpolation)
        codes = (interpolation_code(first), interpolation_code(second))
        first, second = _pair("action_mode", action_mode)
        modes = (one_of("action_mode", first, ACTION_MODES), one_of("action_mode", second, ACTION_MODES))
        if reward is not None and not callable(reward):
            raise ArgumentTypeError(f"reward: expected a function of a GameTransition, got {reward!r:.80}")
        setup = {
            "interpolation": codes,
            "action_mode": modes,
            "clip_actions": flag("clip_actions", clip_actions),
            "factors": perturbation_names(profile),
            "perturbations": perturbations_json(perturbations),
            "mismatch_seed": mismatch_seed_text(mismatch_seed),
            "max_steps": steps,
            "ends_at_divergence": ends_at_divergence,
        }
        return cls(codes, modes, json.dumps(setup, allow_nan=False), steps, reward or default_reward)

    def action_spaces(self) -> list[Any]:
        """The spaces of both robots' actions."""
        return [action_space(code, mode) for code, mode in zip(self.interpolations, self.action_modes, strict=True)]


@dataclass
class GameResults:
    """The arrays of a step's results, with a row per game, which the native half writes. Pairs have robot 1 first."""

    #: (games, 2, 23), float32.
    observations: Observation
    #: (games, 2, 23), float32: the last observations of games that ended in this step, where it also began the next game.
    final_observations: Observation
    #: (games, 23): numbers about each game, such as its score, which the properties below name.
    game_info: Floats
    #: (games, 40): true states after the step.
    states: Floats
    #: (games, 2)
    rewards: Floats

    @classmethod
    def make(cls, games: int) -> GameResults:
        """Zeroed arrays."""
        return cls(
            np.zeros((games, 2, 23), np.float32),
            np.zeros((games, 2, 23), np.float32),
            np.zeros((games, _native.GAME_INFO_LEN)),
            np.zeros((games, _native.GAME_STATE_LEN)),
            np.zeros((games, 2)),
        )

    def arrays(self) -> tuple[Any, ...]:
        """The arrays as the native half expects them."""
        return (
            self.observations.reshape(-1, 23),
            self.final_observations.reshape(-1, 23),
            self.game_info,
            self.states,
        )

    @property
    def rally_ended(self) -> Bools:
        """[games] whether the step ended a rally."""
        return self.game_info[:, 0] >= 0.0

    @property
    def rally_ends(self) -> npt.NDArray[np.object_]:
        """[games] how the rally ended; None while it is under way."""
        ends = np.full(len(self.game_info), None, object)
        for game in np.flatnonzero(self.rally_ended):
            ends[game] = _native.RALLY_ENDS[int(self.game_info[game, 0])]
        return ends

    @property
    def by(self) -> npt.NDArray[np.int64]:
        """[games] the robot (0 or 1) that scored, or on whose side the puck stayed too long; -1 without one."""
        return self.game_info[:, 1].astype(np.int64)

    @property
    def constraints(self) -> Floats:
        """[games][2][4] values of the constraints, a copy."""
        return self.game_info[:, 2:10].reshape(-1, 2, 4).copy()

    @property
    def diverged(self) -> Bools:
        """[games][2] whether the robot's commands made the world diverge in this step."""
        return self.game_info[:, 10:12] > 0.0

    @property
    def goals(self) -> npt.NDArray[np.int64]:
        """[games][2]"""
        return self.game_info[:, 12:14].astype(np.int64)

    @property
    def fouls(self) -> npt.NDArray[np.int64]:
        """[games][2]"""
        return self.game_info[:, 14:16].astype(np.int64)

    @property
    def score(self) -> npt.NDArray[np.int64]:
        """[games][2]"""
        return self.game_info[:, 16:18].astype(np.int64)

    @property
    def points(self) -> npt.NDArray[np.int64]:
        """[games][2] points that the step added."""
        return self.game_info[:, 18:20].astype(np.int64)

    @property
    def steps(self) -> npt.NDArray[np.int64]:
        """[games] control steps of the game; 0 if it has just begun."""
        return self.game_info[:, 20].astype(np.int64)

    @property
    def numbers(self) -> npt.NDArray[np.int64]:
        """[games] the game's number; at its end that of the ended game."""
        return self.game_info[:, 21].astype(np.int64)

    @property
    def is_over(self) -> Bools:
        """[games] whether the step ended the game."""
        return self.game_info[:, 22] > 0.0


class GameBatch:
    """Games with the same arguments, and the arrays of their last step. It can be pickled and copied."""

    def __init__(self, arguments: GameArguments, games: int, *, threads: int, autoreset: str) -> None:
        self.arguments = arguments
        self.games = games
        #: Overwritten by each step and reset; environments hand out copies, so that callers may change them.
        self.results = GameResults.make(games)
        self._threads = threads
        self._autoreset = autoreset
        self._native: _native.Games | None = self._new_native()

    def _new_native(self) -> _native.Games:
        return _native.Games(self.arguments.setup, self.games, self._threads, self._autoreset)

    @property
    def native(self) -> _native.Games:
        """The native half; refused after :meth:`close`."""
        if self._native is None:
            raise ClosedError("expected an open environment, got one that was closed: make a new one")
        return self._native

    @property
    def is_started(self) -> bool:
        """Whether all games were reset once."""
        return bool(self.native.origins())

    def reset(self, mask: Bools, seeds: Sequence[int | None]) -> None:
        """Begins the games of the mask: the first one of a seed, or the next one of the last seed."""
        self.native.reset(mask, list(seeds), self.results.arrays())
        self.results.rewards[mask] = 0.0

    def step(self, actions: Sequence[Floats | None]) -> None:
        """One control step; actions of both robots, (games, n) each, or None if that robot's arm holds."""
        native, results = self.native, self.results
        before = results.observations
        if self.arguments.reward is not default_reward:
            before = before.copy()
        native.step(list(actions), results.arrays())
        results.rewards = self._rewards(before)

    def _rewards(self, before: Observation) -> Floats:
        results = self.results
        started = results.steps == 0
        after = results.observations
        if self._autoreset == "same_step":
            after = np.where(results.is_over[:, None, None], results.final_observations, after)
        transition = GameTransition(
            observations=before,
            next_observations=after,
            puck=results.states[:, :6].copy(),
            robots=results.states[:, 6:].reshape(-1, 2, 17).copy(),
            constraints=results.constraints,
            rally_end=results.rally_ends,
            by=results.by,
            points=results.points,
            diverged=results.diverged,
        )
        rewards = self._call_reward(transition)
        rewards[started] = 0.0
        return rewards

    def _call_reward(self, transition: GameTransition) -> Floats:
        return read_rewards(self.arguments.reward(transition), (self.games, 2))

    def close(self) -> None:
        """Releases the games; may be called more than once."""
        if self._native is not None:
            self._native.close()
            self._native = None

    def __getstate__(self) -> dict[str, Any]:
        state = self.__dict__.copy()
        native = state.pop("_native")
        state["_is_open"] = native is not None
        is_started = native is not None and bool(native.origins())
        state["_saved"] = [native.save(game) for game in range(self.games)] if is_started else []
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        is_open, saved = state.pop("_is_open"), state.pop("_saved")
        self.__dict__.update(state)
        self._native = self._new_native() if is_open else None
        pickled, self.results = self.results, GameResults.make(self.games)
        for game, snapshot in enumerate(saved):
            self.native.restore(game, snapshot, self.results.arrays())
        # A snapshot has no rewards.
        self.results.rewards = pickled.rewards


class SingleGameBatch(GameBatch):
    """One game, whose reward function gets arrays without the first dimension."""

    def _call_reward(self, transition: GameTransition) -> Floats:
        by = int(transition.by[0])
        single = GameTransition(
            observations=transition.observations[0].copy(),
            next_observations=transition.next_observations[0].copy(),
            puck=transition.puck[0],
            robots=transition.robots[0],
            constraints=transition.constraints[0],
            rally_end=transition.rally_end[0],
            by=None if by < 0 else by,
            points=transition.points[0],
            diverged=transition.diverged[0],
        )
        return read_rewards(self.arguments.reward(single), (2,))[None]


def read_rewards(value: object, shape: tuple[int, ...]) -> Floats:
    """The result of a reward function as a new array of this shape; refused unless it consists of finite numbers."""
    expected = f"reward: expected a function that returns finite numbers of shape {shape}"
    try:
        array = np.asarray(value)
    except (ValueError, TypeError, RuntimeError) as error:
        raise ArgumentError(f"{expected}, got {error}") from None
    if array.dtype.kind not in "fiub":
        raise ArgumentTypeError(f"{expected}, got {value!r:.80}")
    if array.shape != shape or not np.isfinite(array).all():
        raise ArgumentError(f"{expected}, got {value!r:.80}")
    return array.astype(np.float64)


def agent_of(robot: int) -> str | None:
    """The name of robot 0 or 1, None for -1."""
    return AGENTS[robot] if robot >= 0 else None


def _pair(name: str, value: Any) -> tuple[Any, Any]:
    if isinstance(value, (tuple, list)):
        if len(value) != 2:
            raise ArgumentError(f"{name}: expected one for both robots or a pair, got {value!r:.80}")
        return value[0], value[1]
    return value, value
