"""One side of a game as a Gymnasium environment, for self-play against a pool of opponents."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np

from faceoff._arguments import integer, known_names, one_of, seed_number
from faceoff.errors import ArgumentError, ArgumentTypeError
from faceoff.game.batch import GAME_ARGUMENTS
from faceoff.game.parallel import AirHockeyGame
from faceoff.game.transition import AGENTS, Observation

#: From an observation, (23,) float32 of its own side, to an action.
Opponent = Callable[[Observation], Any]


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
        self.opponents: list[Opponent] = read_pool(opponents)
        self._side = one_of("side", side, [*AGENTS, "random"])
        known_names("SelfPlayEnv", game_arguments, GAME_ARGUMENTS)
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

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begins a game. ``options={"opponent": i}`` selects an opponent; info has ``opponent`` and ``side``.

        By default opponent and random side follow from the game's seed and number.
        """
        if seed is not None:
            seed = seed_number("seed", seed)
        check_pool(self.opponents)
        chosen = self._read_opponent(options)
        super().reset(seed=seed)
        if seed is None and self.game._seed is None:
            seed = int(self.np_random.integers(2**63))
        self._observations, infos = self.game.reset(seed=seed)
        index, robot = draw_opponent(infos[AGENTS[0]]["seed"], infos[AGENTS[0]]["game_number"], len(self.opponents))
        index = index if chosen is None else chosen
        if self._side == "random":
            self._own, self._other = AGENTS[robot], AGENTS[1 - robot]
        self._opponent = self.opponents[index]
        reset_opponent = getattr(self._opponent, "reset", None)
        if reset_opponent is not None:
            reset_opponent()
        return self._observations[self._own], infos[self._own] | {"opponent": index, "side": self._own}

    def _read_opponent(self, options: object) -> int | None:
        if options is None:
            return None
        if not isinstance(options, Mapping):
            raise ArgumentTypeError(f"options: expected a mapping with opponent, got {options!r:.80}")
        unknown = [name for name in options if name != "opponent"]
        if unknown:
            raise ArgumentError(f"options: expected opponent, got {unknown[0]!r}")
        index = options.get("opponent")
        return None if index is None else integer("options['opponent']", index, 0, len(self.opponents) - 1)

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One control step of both robots; reward and info are those of the own side."""
        actions = {self._own: action}
        if self._other in self.game.agents:
            actions[self._other] = self._opponent(self._observations[self._other])
        observations, rewards, terminated, truncated, infos = self.game.step(actions)
        self._observations = observations
        own = self._own
        return observations[own], rewards[own], terminated[own], truncated[own], infos[own]

    def __copy__(self) -> SelfPlayEnv:
        # Opponents are functions: copies share them, not the list.
        return copy.deepcopy(self, {id(opponent): opponent for opponent in [*self.opponents, self._opponent]})

    def render(self) -> Any:
        """As :meth:`AirHockeyGame.render`."""
        return self.game.render()

    def close(self) -> None:
        """Releases the game; may be called more than once."""
        self.game.close()


def _other(agent: str) -> str:
    return AGENTS[1 - AGENTS.index(agent)]


def draw_opponent(seed: int, game_number: int, opponents: int) -> tuple[int, int]:
    """The opponent's index and the own robot, 0 or 1, of a game: they follow from its seed and number."""
    random = np.random.default_rng([seed, game_number])
    return int(random.integers(opponents)), int(random.integers(2))


def read_pool(opponents: object) -> list[Any]:
    """The opponents as a list with at least one function."""
    if isinstance(opponents, (str, bytes)) or not isinstance(opponents, Iterable):
        raise ArgumentTypeError(f"opponents: expected a list of functions, got {opponents!r:.80}")
    pool = list(opponents)
    check_pool(pool)
    return pool


def check_pool(pool: Sequence[object]) -> None:
    """Refuses an empty pool, and members that cannot be called. The pool may change during training."""
    if not pool:
        raise ArgumentError("opponents: expected at least one, got none")
    for index, opponent in enumerate(pool):
        if not callable(opponent):
            raise ArgumentTypeError(
                f"opponents[{index}]: expected a function from an observation to an action, got {opponent!r:.80}"
            )
