"""The game of two robots for PettingZoo."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np
import numpy.typing as npt
from pettingzoo import ParallelEnv

from faceoff._arguments import ActionMode, numbers, one_of, seed_number
from faceoff.errors import ArgumentError, ArgumentTypeError, OrderError
from faceoff.game.batch import GameArguments, Interpolations, SingleGameBatch, agent_of
from faceoff.game.render import GameView
from faceoff.game.transition import AGENTS, GAME_STEPS, GameReward, Observation
from faceoff.gym.call_guard import CallGuard, exclusive
from faceoff.gym.spaces import game_observation_space


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

    A game can be pickled and copied: the copy continues with the same bits.
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
        interpolation: Interpolations = 1,
        action_mode: ActionMode | tuple[ActionMode, ActionMode] = "delta",
        clip_actions: bool = False,
        profile: str | Sequence[str] = "ideal",
        perturbations: Mapping[str, Any] | None = None,
        mismatch_seed: int | str | None = None,
        reward: GameReward | None = None,
        render_mode: str | None = None,
    ) -> None:
        arguments = GameArguments.read(
            max_steps=max_steps,
            interpolation=interpolation,
            action_mode=action_mode,
            clip_actions=clip_actions,
            profile=profile,
            perturbations=perturbations,
            mismatch_seed=mismatch_seed,
            reward=reward,
            ends_at_divergence=False,
        )
        if render_mode is not None:
            one_of("render_mode", render_mode, self.metadata["render_modes"])
        self._batch = SingleGameBatch(arguments, 1, threads=1, autoreset="disabled")
        self.render_mode = render_mode
        self.possible_agents = list(AGENTS)
        self.agents: list[str] = []
        self._observation_spaces = {agent: game_observation_space() for agent in AGENTS}
        self._action_spaces: dict[str, gymnasium.spaces.Box] = dict(zip(AGENTS, arguments.action_spaces(), strict=True))
        self._seed: int | None = None
        self._calls = CallGuard()
        self._view = GameView("faceoff game", render_mode, self.metadata["render_fps"])

    def observation_space(self, agent: str) -> gymnasium.spaces.Box:
        """(23,) float32; the same object on each call."""
        return self._observation_spaces[one_of("agent", agent, AGENTS)]

    def action_space(self, agent: str) -> gymnasium.spaces.Box:
        """(n,) float32 by the agent's interpolation; the same object on each call."""
        return self._action_spaces[one_of("agent", agent, AGENTS)]

    @exclusive
    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Begins the first game of ``seed``; without one, the next game of the last seed. ``options`` are ignored."""
        batch = self._batch
        batch.native  # noqa: B018 - refuses a closed environment before anything changes
        # The seed whose first game begins; None: the next game of the last seed.
        new_seed: int | None = None
        if seed is not None:
            new_seed = seed_number("seed", seed)
        elif self._seed is None:
            new_seed = int(np.random.default_rng().integers(2**63))
        batch.reset(np.ones(1, np.bool_), [new_seed])
        [(self._seed, number)] = batch.native.origins()
        self.agents = list(AGENTS)
        self._render_human()
        info = {"seed": self._seed, "game_number": number}
        return self._observations_of(self.agents), {agent: dict(info) for agent in self.agents}

    @exclusive
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

        Infos have ``constraints``, ``score``, ``goals`` and ``fouls`` (robot 1 first). If a rally has ended, they have
        ``rally_end`` (how), and ``rally_end_by``: the robot that scored, or on whose side the puck stayed too long;
        None after other ends.
        """
        batch = self._batch
        batch.native  # noqa: B018 - the error about a closed environment comes first
        if not self.agents:
            raise OrderError("step: expected a game under way, got one that has ended: call reset() first")
        checked = self._check_actions(actions)
        batch.step(checked)
        results = batch.results
        is_over = bool(results.steps[0] >= batch.arguments.max_steps)
        live = self.agents
        terminations = {agent: bool(results.diverged[0, AGENTS.index(agent)]) for agent in live}
        truncations = {agent: is_over and not terminations[agent] for agent in live}
        infos = {agent: self._info(AGENTS.index(agent)) for agent in live}
        self.agents = [agent for agent in live if not (terminations[agent] or truncations[agent])]
        self._render_human()
        return (
            self._observations_of(live),
            {agent: float(results.rewards[0, AGENTS.index(agent)]) for agent in live},
            terminations,
            truncations,
            infos,
        )

    def _check_actions(self, actions: object) -> list[npt.NDArray[np.float64] | None]:
        if not isinstance(actions, Mapping):
            raise ArgumentTypeError(f"actions: expected a mapping from agents to actions, got {actions!r:.80}")
        for agent in actions:
            if agent not in AGENTS:
                raise ArgumentError(f"actions: expected {' and '.join(self.agents)}, got {agent!r}")
        for agent in self.agents:
            if agent not in actions:
                raise ArgumentError(f"actions: expected one for each of {', '.join(self.agents)}, got none for {agent}")
        return [
            numbers(f"action of {agent}", actions[agent], self._action_spaces[agent].shape)[None]  # type: ignore[arg-type]
            if agent in self.agents
            else None
            for agent in AGENTS
        ]

    def _observations_of(self, agents: Sequence[str]) -> dict[str, Observation]:
        observations = self._batch.results.observations[0]
        return {agent: observations[AGENTS.index(agent)].copy() for agent in agents}

    def _info(self, robot: int) -> dict[str, Any]:
        results = self._batch.results
        info: dict[str, Any] = {
            "constraints": results.constraints[0, robot],
            "score": tuple(results.score[0].tolist()),
            "goals": tuple(results.goals[0].tolist()),
            "fouls": tuple(results.fouls[0].tolist()),
        }
        if results.rally_ended[0]:
            info["rally_end"] = results.rally_ends[0]
            info["rally_end_by"] = agent_of(int(results.by[0]))
        return info

    @exclusive
    def render(self) -> npt.NDArray[np.uint8] | None:
        """A picture of the table from above, (360, 640, 3) uint8; None for ``human``, which shows a window."""
        return self._view.show(self._batch.native.state(0))

    def _render_human(self) -> None:
        if self.render_mode == "human":
            self.render()

    def __copy__(self) -> AirHockeyGame:
        return copy.deepcopy(self)

    def close(self) -> None:
        """Releases the game and the window; may be called more than once."""
        self._batch.close()
        self.agents = []
        self._view.close()
