"""The game of two robots: a PettingZoo environment, and one side of it as a Gymnasium environment for self-play.

A game consists of rallies: each lasts until a goal, a foul or another reason to put the puck down again.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from faceoff import _native
from faceoff._arguments import (
    ACTION_MODES,
    ActionMode,
    factor_names,
    integer,
    interpolation_code,
    mismatch_seed_text,
    numbers,
    one_of,
    perturbations_json,
    seed_number,
)
from faceoff._distribution import install_command
from faceoff.errors import ArgumentError, ArgumentTypeError, ClosedError, MissingError, OrderError

try:
    import gymnasium
    from pettingzoo import ParallelEnv
except ImportError as error:  # pragma: no cover - depends on what is installed
    raise MissingError(f"faceoff.game needs gymnasium and pettingzoo: {install_command('games')}") from error

from faceoff.gym.reward import State
from faceoff.gym.spaces import action_space, game_observation_space

#: Both robots, robot 1 first.
AGENTS = ("robot_1", "robot_2")
#: Control steps of the competition's games: 15 minutes.
GAME_STEPS = 45_000

Observation = npt.NDArray[np.float32]
Opponent = Callable[[Observation], Any]


@dataclass(frozen=True)
class GameTransition:
    """A control step of a game, for a reward function. In pairs robot 1 comes first."""

    #: (2, 23) observations of both robots before the step, float32.
    observations: Observation
    #: (2, 23) observations after the step, float32; those of the next rally if one has begun.
    next_observations: Observation
    #: (6,) the puck after the step, before the next rally begins: x, y, yaw, vx, vy, yaw rate in the table's frame.
    puck: npt.NDArray[np.float64]
    #: (2, 17) joint positions (7) and velocities (7), and the end effector (3) in the robot's own base frame.
    robots: npt.NDArray[np.float64]
    #: (2, 4) values in the order of :data:`faceoff.gym.CONSTRAINTS`; above 0 is a violation.
    constraints: npt.NDArray[np.float64]
    #: How the rally ended: goal, foul, stuck, left_table or diverged; None while it is under way.
    rally_end: str | None
    #: The robot (0 or 1) that scored, or on whose side the puck stayed too long.
    by: int | None
    #: (2,) points that the step added to each side: goals, and one for every third foul of the opponent.
    points: npt.NDArray[np.int64]
    #: (2,) whether the robot's commands made the world diverge.
    diverged: npt.NDArray[np.bool_]


GameReward = Callable[[GameTransition], Any]


def default_reward(transition: GameTransition) -> npt.NDArray[np.float64]:
    """(2,): points gained minus the opponent's; minus 10 for a robot that made the world diverge."""
    gained = transition.points.astype(np.float64)
    return gained - gained[::-1] - 10.0 * transition.diverged


class AirHockeyGame(ParallelEnv[str, Observation, Any]):  # type: ignore[misc]
    """A game under the competition's rules, for agents ``robot_1`` and ``robot_2``.

    Each observes the table from its own side, (23,) float32. After the end of a rally the next step begins the next
    one; the game is truncated after ``max_steps``. A robot whose commands make the world diverge is terminated: it
    leaves ``agents``, its arm holds still, and the other robot continues.

    Args:
        max_steps: control steps of a game.
        interpolation, action_mode: as for :class:`faceoff.gym.AirHockeyEnv`; one value for both robots, or a pair.
        clip_actions, profile, perturbations, mismatch_seed: as for :class:`faceoff.gym.AirHockeyEnv`.
        reward: from a :class:`GameTransition` to two numbers, robot 1 first, instead of :func:`default_reward`.
        render_mode: ``rgb_array``, ``human`` or None.
    """

    metadata: ClassVar[dict[str, Any]] = {  # type: ignore[misc]
        "name": "faceoff_air_hockey_v0",
        "render_modes": ["rgb_array", "human"],
        "render_fps": 50,
        "is_parallelizable": True,
    }

    def __init__(
        self,
        *,
        max_steps: int = GAME_STEPS,
        interpolation: int | None | tuple[int | None, int | None] = 1,
        action_mode: ActionMode | tuple[ActionMode, ActionMode] = "delta",
        clip_actions: bool = False,
        profile: str | Sequence[str] = "ideal",
        perturbations: Mapping[str, Any] | None = None,
        mismatch_seed: int | str | None = None,
        reward: GameReward | None = None,
        render_mode: str | None = None,
    ) -> None:
        self._max_steps = integer("max_steps", max_steps, 1, 1_000_000)
        codes = [interpolation_code(code) for code in _pair("interpolation", interpolation)]
        modes = [
            one_of("action_mode", mode, ACTION_MODES) for mode in _pair("action_mode", action_mode)
        ]
        if render_mode is not None:
            one_of("render_mode", render_mode, self.metadata["render_modes"])
        if reward is not None and not callable(reward):
            raise ArgumentTypeError(f"reward: expected a function of a GameTransition, got {reward!r}")
        setup = {
            "interpolation": codes,
            "action_mode": modes,
            "clip_actions": bool(clip_actions),
            "factors": factor_names(profile),
            "perturbations": perturbations_json(perturbations),
            "mismatch_seed": mismatch_seed_text(mismatch_seed),
        }
        try:
            self._game: _native.Game | None = _native.Game(json.dumps(setup, allow_nan=False))
        except (TypeError, ValueError) as error:
            if isinstance(error, ArgumentError):
                raise
            raise ArgumentError(f"perturbations: expected finite numbers, got {error}") from None
        self.render_mode = render_mode
        self.possible_agents = list(AGENTS)
        self.agents: list[str] = []
        self._observation_spaces = {agent: game_observation_space() for agent in AGENTS}
        self._action_spaces = {
            agent: action_space(code, mode)
            for agent, code, mode in zip(AGENTS, codes, modes, strict=True)
        }
        self._reward = default_reward if reward is None else reward
        self._observations = np.zeros((2, 23), np.float32)
        self._score = np.zeros(2, np.int64)
        self._steps = 0
        self._seed: int | None = None
        self._number = 0
        self._window: Any = None

    def observation_space(self, agent: str) -> gymnasium.spaces.Box:
        """(23,) float32; the same object on each call."""
        return self._observation_spaces[one_of("agent", agent, AGENTS)]

    def action_space(self, agent: str) -> gymnasium.spaces.Box:
        """(n,) float32 by the agent's interpolation; the same object on each call."""
        return self._action_spaces[one_of("agent", agent, AGENTS)]

    def _require_game(self) -> _native.Game:
        if self._game is None:
            raise ClosedError("expected an open environment, got one that was closed: make a new one")
        return self._game

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Begins the first game of ``seed``; without one, the next game of the last seed. ``options`` are ignored."""
        game = self._require_game()
        if seed is not None:
            self._seed, self._number = seed_number("seed", seed), 0
        elif self._seed is None:
            self._seed, self._number = int(np.random.default_rng().integers(2**63)), 0
        else:
            self._number += 1
        game.reset(self._seed, self._number, self._observations)
        self.agents = list(AGENTS)
        self._score = np.zeros(2, np.int64)
        self._steps = 0
        self._render_human()
        info = {"seed": self._seed, "game_number": self._number}
        return self._observations_of(self.agents), {agent: dict(info) for agent in self.agents}

    def step(
        self, actions: dict[str, Any]
    ) -> tuple[
        dict[str, Observation],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """One control step, 20 ms. ``actions`` has an action for each of ``agents``.

        Infos have ``constraints``, ``score``, ``goals`` and ``fouls`` (robot 1 first), and ``rally_end`` if a rally
        has ended.
        """
        game = self._require_game()
        if not self.agents:
            raise OrderError("step: expected a game under way, got one that has ended: call reset() first")
        if not isinstance(actions, Mapping):
            raise ArgumentTypeError(f"actions: expected a mapping from agents to actions, got {actions!r:.80}")
        for agent in actions:
            if agent not in AGENTS:
                raise ArgumentError(f"actions: expected {' and '.join(self.agents)}, got {agent!r}")
        for agent in self.agents:
            if agent not in actions:
                raise ArgumentError(f"actions: expected one for each of {', '.join(self.agents)}, got none for {agent}")
        checked = [
            numbers(f"action of {agent}", actions[agent], self._action_spaces[agent].shape)  # type: ignore[arg-type]
            if agent in self.agents
            else None
            for agent in AGENTS
        ]
        before = self._observations.copy()
        result = game.step(checked, self._observations)
        self._steps += 1
        score = np.array(result["score"], np.int64)
        transition = GameTransition(
            observations=before,
            next_observations=self._observations.copy(),
            puck=np.array(result["puck"]),
            robots=np.array(result["robots"]),
            constraints=np.array(result["constraints"]),
            rally_end=result["rally_end"],
            by=result["by"],
            points=score - self._score,
            diverged=np.array(result["diverged"], np.bool_),
        )
        self._score = score
        rewards = np.asarray(self._reward(transition), np.float64)
        if rewards.shape != (2,) or not np.isfinite(rewards).all():
            raise ArgumentError(f"reward: expected a function that returns two finite numbers, got {rewards!r:.80}")
        is_over = self._steps >= self._max_steps
        live = self.agents
        terminations = {agent: bool(transition.diverged[AGENTS.index(agent)]) for agent in live}
        truncations = {agent: is_over and not terminations[agent] for agent in live}
        infos = {agent: self._info(transition, result, AGENTS.index(agent)) for agent in live}
        self.agents = [agent for agent in live if not (terminations[agent] or truncations[agent])]
        self._render_human()
        return (
            self._observations_of(live),
            {agent: float(rewards[AGENTS.index(agent)]) for agent in live},
            terminations,
            truncations,
            infos,
        )

    def _observations_of(self, agents: Sequence[str]) -> dict[str, Observation]:
        return {agent: self._observations[AGENTS.index(agent)].copy() for agent in agents}

    @staticmethod
    def _info(transition: GameTransition, result: dict[str, Any], robot: int) -> dict[str, Any]:
        info: dict[str, Any] = {
            "constraints": transition.constraints[robot].copy(),
            "score": tuple(result["score"]),
            "goals": tuple(result["goals"]),
            "fouls": tuple(result["fouls"]),
        }
        if transition.rally_end is not None:
            info["rally_end"] = transition.rally_end
            info["rally_end_by"] = None if transition.by is None else AGENTS[transition.by]
        return info

    def render(self) -> npt.NDArray[np.uint8] | None:
        """A picture of the table from above, (360, 640, 3) uint8; None for ``human``, which shows a window."""
        if self.render_mode is None:
            raise ArgumentError(
                "render: expected an environment made with render_mode='rgb_array' or 'human', got None"
            )
        from faceoff.gym.render import draw

        puck, robots = self._require_game().state()
        array = np.zeros(_native.STATE_LEN)
        array[:6], array[27:30], array[30:33] = puck, robots[0][14:], robots[1][14:]
        frame = draw(State(array), has_opponent=True)
        if self.render_mode == "rgb_array":
            return frame
        if self._window is None:
            from faceoff.gym.window import Window

            self._window = Window("faceoff game", self.metadata["render_fps"])
        self._window.show(frame)
        return None

    def _render_human(self) -> None:
        if self.render_mode == "human":
            self.render()

    def close(self) -> None:
        """Releases the game and the window; may be called more than once."""
        if self._game is not None:
            self._game.close()
            self._game = None
            self.agents = []
        if self._window is not None:
            self._window.close()
            self._window = None


class SelfPlayEnv(gymnasium.Env[Any, Any]):
    """One side of a game, against an opponent drawn from a pool at each reset.

    Args:
        opponents: functions from an observation, (23,) float32 of their own side, to an action. A
            method ``reset()``, if there is one, is called when a game begins.
        side: ``robot_1``, ``robot_2``, or ``random`` to draw the side of each game.
        max_steps: control steps of a game; the default is one minute.
        game_arguments: as for :class:`AirHockeyGame`; with ``random`` sides both robots must have the same action space.

    The pool may grow during training: ``env.unwrapped.opponents.append(policy)`` takes effect at the next reset.
    """

    metadata: ClassVar[dict[str, Any]] = {  # type: ignore[misc]
        "render_modes": ["rgb_array", "human"],
        "render_fps": 50,
    }

    def __init__(
        self,
        opponents: Sequence[Opponent],
        *,
        side: str = "robot_1",
        max_steps: int = 3_000,
        render_mode: str | None = None,
        **game_arguments: Any,
    ) -> None:
        self.opponents: list[Opponent] = list(opponents)
        self._check_pool()
        self._side = one_of("side", side, [*AGENTS, "random"])
        self.game = AirHockeyGame(max_steps=max_steps, render_mode=render_mode, **game_arguments)
        self.render_mode = render_mode
        spaces = [self.game.action_space(agent) for agent in AGENTS]
        if side == "random" and spaces[0] != spaces[1]:
            raise ArgumentError("side: expected robot_1 or robot_2, since their actions differ, got random")
        own = AGENTS[0] if side == "random" else side
        self.observation_space = self.game.observation_space(own)
        self.action_space = self.game.action_space(own)
        self._own, self._other = own, _other(own)
        self._opponent: Opponent = self.opponents[0]
        self._observations: dict[str, Observation] = {}

    def _check_pool(self) -> None:
        if not self.opponents:
            raise ArgumentError("opponents: expected at least one, got none")
        for index, opponent in enumerate(self.opponents):
            if not callable(opponent):
                raise ArgumentTypeError(
                    f"opponents[{index}]: expected a function from an observation to an action, got {opponent!r:.80}"
                )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begins a game. ``options={"opponent": i}`` selects an opponent; info has ``opponent`` and ``side``."""
        if seed is not None:
            seed_number("seed", seed)
        super().reset(seed=seed)
        self._check_pool()
        index = (options or {}).get("opponent")
        if index is None:
            index = int(self.np_random.integers(len(self.opponents)))
        index = integer("options['opponent']", index, 0, len(self.opponents) - 1)
        if self._side == "random":
            self._own = AGENTS[int(self.np_random.integers(2))]
            self._other = _other(self._own)
        if seed is None and self.game._seed is None:
            seed = int(self.np_random.integers(2**63))
        self._opponent = self.opponents[index]
        reset_opponent = getattr(self._opponent, "reset", None)
        if reset_opponent is not None:
            reset_opponent()
        self._observations, infos = self.game.reset(seed=seed)
        return self._observations[self._own], infos[self._own] | {"opponent": index, "side": self._own}

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One control step of both robots; reward and info are those of the own side."""
        actions = {self._own: action}
        if self._other in self.game.agents:
            actions[self._other] = self._opponent(self._observations[self._other])
        observations, rewards, terminated, truncated, infos = self.game.step(actions)
        self._observations = observations
        own = self._own
        return observations[own], rewards[own], terminated[own], truncated[own], infos[own]

    def render(self) -> Any:
        """As :meth:`AirHockeyGame.render`."""
        return self.game.render()

    def close(self) -> None:
        """Releases the game; may be called more than once."""
        self.game.close()


def _other(agent: str) -> str:
    return AGENTS[1 - AGENTS.index(agent)]


def _pair(name: str, value: Any) -> tuple[Any, Any]:
    if isinstance(value, (tuple, list)):
        if len(value) != 2:
            raise ArgumentError(f"{name}: expected one for both robots or a pair, got {value!r}")
        return value[0], value[1]
    return value, value
