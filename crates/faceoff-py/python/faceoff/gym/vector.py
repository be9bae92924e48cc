"""The environment of many worlds (simulated tables), stepped together by threads."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.vector import VectorEnv
from gymnasium.vector.utils import batch_space

from faceoff import _native
from faceoff._arguments import (
    ActionMode,
    Task,
    flag,
    integer,
    interpolation_code,
    mask,
    numbers,
    one_of,
    seed_number,
    write_setup,
)
from faceoff.errors import ArgumentError, ArgumentTypeError, ClosedError, OrderError
from faceoff.gym.call_guard import CallGuard, exclusive
from faceoff.gym.env import AirHockeyEnv, read_options
from faceoff.gym.reward import Reward, State, Transition
from faceoff.gym.rows import Rows
from faceoff.gym.spaces import action_space, observation_space

try:
    from gymnasium.vector import AutoresetMode as AutoresetMode
except ImportError:  # Gymnasium 1.0 has one mode and no name for it.

    class AutoresetMode(Enum):  # type: ignore[no-redef]
        """When a world whose episode has ended begins the next one."""

        NEXT_STEP = "NextStep"
        SAME_STEP = "SameStep"
        DISABLED = "Disabled"


#: Fewer worlds than this do not pay for another thread.
WORLDS_PER_THREAD = 4

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
Step = tuple[npt.NDArray[np.float32], Floats, Bools, Bools, dict[str, Any]]


class AirHockeyVectorEnv(VectorEnv[Any, Any, Any]):
    """Many worlds of a task, stepped together.

    World i after ``reset(seed=s)`` equals an :class:`AirHockeyEnv` after ``reset(seed=s + i)`` bit for bit.

    Args:
        num_envs: number of worlds.
        task, interpolation, action_mode, clip_actions, profile, perturbations, mismatch_seed, max_episode_steps: as for
            :class:`AirHockeyEnv`.
        autoreset_mode: an ``AutoresetMode`` or its value: ``NextStep``, ``SameStep`` or ``Disabled``.
        copy: whether each step returns new arrays. Otherwise observations, rewards and flags are the same arrays each
            time, overwritten by the next step or reset.
        threads: threads of this environment's pool; by default one per CPU that this process may use. Results do not
            depend on it.
        reward: from a :class:`~faceoff.gym.reward.Transition` of all worlds to an array of shape (num_envs,).
        render_mode: ``rgb_array`` or None.
    """

    def __init__(
        self,
        num_envs: int = 1,
        task: Task = "defend",
        *,
        interpolation: int | None = 1,
        action_mode: ActionMode = "delta",
        clip_actions: bool = False,
        profile: str | Sequence[str] = "ideal",
        perturbations: Mapping[str, Any] | None = None,
        mismatch_seed: int | str | None = None,
        max_episode_steps: int | None = None,
        reward: Reward | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        threads: int | None = None,
        render_mode: str | None = None,
    ) -> None:
        self.num_envs = integer("num_envs", num_envs, 1, 1_000_000)
        self._setup = write_setup(
            task=task,
            interpolation=interpolation,
            action_mode=action_mode,
            clip_actions=clip_actions,
            profile=profile,
            perturbations=perturbations,
            mismatch_seed=mismatch_seed,
            max_episode_steps=max_episode_steps,
        )
        self.autoreset_mode = read_autoreset_mode(autoreset_mode)
        if render_mode is not None:
            one_of("render_mode", render_mode, ["rgb_array"])
        if reward is not None and not callable(reward):
            raise ArgumentTypeError(f"reward: expected a function of a Transition, got {reward!r}")
        if threads is None:
            useful = -(-self.num_envs // WORLDS_PER_THREAD)
            threads = min(available_cpus(), useful)
        self._threads = integer("threads", threads, 1, 1024)
        self.task = task
        self.action_mode = action_mode
        self.interpolation = interpolation_code(interpolation)
        self.clip_actions = flag("clip_actions", clip_actions)
        self.copy = flag("copy", copy)
        self.render_mode = render_mode
        self.metadata = {**AirHockeyEnv.metadata, "render_modes": ["rgb_array"]}
        self.metadata["autoreset_mode"] = self.autoreset_mode
        self.single_observation_space = observation_space(task)
        self.single_action_space = action_space(interpolation, action_mode)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._reward = reward
        self._calls = CallGuard()
        self._is_started = False
        self._seeds = np.zeros(self.num_envs, np.int64)
        self._sent: tuple[Floats, npt.NDArray[np.float32], Floats] | None = None
        self._worlds: _native.Worlds | None = self._new_worlds()
        self._rows = self._new_rows()

    def _new_worlds(self) -> _native.Worlds:
        mode = self.autoreset_mode.name.lower()
        return _native.Worlds(self._setup, self.num_envs, self._threads, mode)

    def _new_rows(self) -> Rows:
        return Rows.make(
            self.num_envs,
            self.single_observation_space.shape[0],  # type: ignore[index]
            final_observations=self.autoreset_mode.name == "SAME_STEP",
            states=self._reward is not None,
        )

    def _require_worlds(self) -> _native.Worlds:
        if self._worlds is None:
            raise ClosedError("expected an open environment, got one that was closed: make a new one")
        return self._worlds

    # --- reset -------------------------------------------------------------------------------------------------

    @exclusive
    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Begins an episode in every world, or in those of ``options["reset_mask"]``, an array of bool.

        Args:
            seed: s for seeds s, s + 1, …; or a sequence with one per world, None to continue with its next episode.
            options: ``reset_mask``, and ``episode`` and ``puck`` as for :meth:`AirHockeyEnv.reset`, for all worlds.
        """
        worlds = self._require_worlds()
        if options is not None and not isinstance(options, Mapping):
            raise ArgumentTypeError(f"options: expected a mapping, got {options!r:.80}")
        options = dict(options or {})
        is_reset = np.ones(self.num_envs, np.bool_)
        if options.get("reset_mask") is not None:
            is_reset = mask("options['reset_mask']", options["reset_mask"], self.num_envs)
        options.pop("reset_mask", None)
        number, puck = read_options(options)
        seeds = read_seeds(seed, self.num_envs, "worlds")
        super().reset(seed=seeds[0] if np.ndim(seed) == 0 else None)  # type: ignore[arg-type]
        if not self._is_started:
            fallback = self.np_random.integers(2**63, size=self.num_envs).tolist()
            seeds = [new if seed is None else seed for seed, new in zip(seeds, fallback, strict=True)]
        worlds.reset(is_reset, seeds, number, puck, self._rows_to_write().arrays())
        self._is_started = True
        origins = np.array(worlds.origins(), np.uint64).astype(np.int64)
        self._seeds = origins[:, 0].copy()
        return self._observations(), self._origins(is_reset, origins[:, 1])

    def _origins(self, is_reset: Bools, episode_numbers: npt.NDArray[np.int64]) -> dict[str, Any]:
        return {
            "seed": np.where(is_reset, self._seeds, 0),
            "_seed": is_reset.copy(),
            "episode_number": np.where(is_reset, episode_numbers, 0),
            "_episode_number": is_reset.copy(),
        }

    # --- step --------------------------------------------------------------------------------------------------

    @exclusive
    def step(self, actions: Any) -> Step:
        """One control step of every world, 20 ms; ``actions`` is (num_envs, n).

        Infos are arrays, each with a mask (``constraints`` and ``_constraints``, …), as
        :class:`gymnasium.vector.SyncVectorEnv` collects them from :class:`AirHockeyEnv`.
        """
        worlds = self._require_worlds()
        checked = numbers("actions", actions, self.action_space.shape)  # type: ignore[arg-type]
        before = self._before()
        rows = self._rows_to_write()
        worlds.step(checked, rows.arrays())
        return self._result(checked, before)

    @exclusive
    def send(self, actions: Any) -> None:
        """Begins a step in other threads; :meth:`recv` waits for it. No other method may be called in between."""
        worlds = self._require_worlds()
        checked = numbers("actions", actions, self.action_space.shape)  # type: ignore[arg-type]
        worlds.send(checked, self._reward is not None)
        self._sent = (checked, *self._before())

    @exclusive
    def recv(self) -> Step:
        """Waits for the step that was sent, and returns its result as :meth:`step` does."""
        worlds = self._require_worlds()
        if self._sent is None:
            raise OrderError("recv: expected a step that was sent, got none: call send() first")
        worlds.recv(self._rows_to_write().arrays())
        checked, observations, states = self._sent
        self._sent = None
        return self._result(checked, (observations, states))

    def _before(self) -> tuple[npt.NDArray[np.float32], Floats]:
        if self._reward is None:
            return self._rows.observations, self._rows.next_states
        return self._rows.observations.copy(), self._rows.next_states.copy()

    def _rows_to_write(self) -> Rows:
        """The arrays for the next results: with ``copy`` the earlier ones stay the caller's."""
        if self.copy:
            self._rows.renew()
        return self._rows

    def _observations(self) -> npt.NDArray[np.float32]:
        # The next step and a reset of some worlds go on from this array, so the caller gets a copy, which it may change.
        return self._rows.observations.copy() if self.copy else self._rows.observations

    def _result(
        self, checked: Floats, before: tuple[npt.NDArray[np.float32], Floats]
    ) -> Step:
        rows = self._rows
        ended = rows.episode_info[:, 0] >= 0.0
        was_reset = rows.episode_info[:, 3] == 0.0
        if self._reward is not None:
            rows.rewards[:] = self._custom_rewards(checked, before, ended)
            rows.rewards[was_reset] = 0.0
        infos: dict[str, Any] = {}
        same_step = self.autoreset_mode.name == "SAME_STEP"
        has_step_info = ~was_reset
        if same_step and ended.any():
            finals = np.full(self.num_envs, None, object)
            for world in np.flatnonzero(ended):
                finals[world] = rows.final_observations[world].copy()
            infos["final_obs"], infos["_final_obs"] = finals, ended.copy()
            infos["final_info"] = self._step_infos(ended, ended)
            infos["_final_info"] = ended.copy()
            has_step_info &= ~ended
            was_reset = ended
        infos |= self._step_infos(has_step_info, ended & has_step_info)
        if was_reset.any():
            # Infos have the number of the new episode; rows have the number of the ended one.
            infos |= self._origins(was_reset, rows.numbers + int(same_step))
        return self._observations(), rows.rewards, rows.terminated, rows.truncated, infos

    def _step_infos(self, stepped: Bools, ended: Bools) -> dict[str, Any]:
        rows = self._rows
        infos: dict[str, Any] = {}
        if stepped.any():
            constraints = rows.constraints
            constraints[~stepped] = 0.0
            infos["constraints"], infos["_constraints"] = constraints, stepped.copy()
        if ended.any():
            success = np.zeros(self.num_envs, np.bool_)
            ends = np.full(self.num_envs, None, object)
            violations = np.zeros((self.num_envs, 4), np.bool_)
            steps = np.zeros(self.num_envs, np.int64)
            # Few episodes end in a step, so only their rows are read.
            for world in np.flatnonzero(ended).tolist():
                code, is_success, _, count = rows.episode_info[world, :4].tolist()
                success[world] = is_success > 0.0
                ends[world] = _native.ENDS[int(code)]
                violations[world] = rows.episode_info[world, 8:12] > 0.0
                steps[world] = int(count)
            infos |= {"success": success, "end": ends, "violations": violations, "steps": steps}
            for name in ("success", "end", "violations", "steps"):
                infos[f"_{name}"] = ended.copy()
        return infos

    def _custom_rewards(
        self, checked: Floats, before: tuple[npt.NDArray[np.float32], Floats], ended: Bools
    ) -> Floats:
        assert self._reward is not None
        rows = self._rows
        after = rows.observations.copy()
        if self.autoreset_mode.name == "SAME_STEP":
            after[ended] = rows.final_observations[ended]
        transition = Transition(
            observation=before[0],
            action=checked,
            next_observation=after,
            state=State(before[1]),
            next_state=State(rows.states.copy()),
            constraints=rows.constraints,
            violations=rows.violations,
            success=rows.success,
            terminated=rows.terminated.copy(),
            truncated=rows.truncated.copy(),
        )
        rewards = np.asarray(self._reward(transition))
        if rewards.shape != (self.num_envs,) or rewards.dtype.kind not in "fiub":
            raise ArgumentError(
                f"reward: expected a function that returns an array of shape ({self.num_envs},), got {rewards!r:.80}"
            )
        if not np.isfinite(rewards).all():
            raise ArgumentError(f"reward: expected finite numbers, got {rewards[~np.isfinite(rewards)][0]}")
        return rewards.astype(np.float64)

    # --- state -------------------------------------------------------------------------------------------------

    @exclusive
    def save(self) -> list[_native.Snapshot]:
        """The exact state of every world. States can be pickled, and restored into an :class:`AirHockeyEnv`, too."""
        worlds = self._require_worlds()
        return [worlds.save(world) for world in range(self.num_envs)]

    @exclusive
    def restore(
        self, states: Sequence[_native.Snapshot]
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Restores a saved state in every world. Returns observations and infos as :meth:`reset` does."""
        worlds = self._require_worlds()
        if len(states) != self.num_envs:
            raise ArgumentError(f"states: expected one for each of {self.num_envs} worlds, got {len(states)}")
        for index, state in enumerate(states):
            if not isinstance(state, _native.Snapshot):
                raise ArgumentTypeError(f"states[{index}]: expected what save() returned, got {state!r:.80}")
        if not self._is_started:
            self.reset(seed=0)
        rows = self._rows_to_write()
        for index, state in enumerate(states):
            worlds.restore(index, state, rows.arrays())
        origins = np.array(worlds.origins(), np.uint64).astype(np.int64)
        self._seeds = origins[:, 0].copy()
        all_worlds = np.ones(self.num_envs, np.bool_)
        return self._observations(), self._origins(all_worlds, origins[:, 1])

    @property
    def state(self) -> State:
        """The present true state of all worlds; the first dimension of each array is the world."""
        worlds = self._require_worlds()
        return State(np.array([worlds.state(world) for world in range(self.num_envs)]))

    def render(self) -> tuple[npt.NDArray[np.uint8], ...]:  # type: ignore[override]
        """A picture of each world's table from above, (360, 640, 3) uint8."""
        if self.render_mode is None:
            raise ArgumentError("render: expected an environment made with render_mode='rgb_array', got None")
        from faceoff.gym.render import draw

        states = self.state.array
        return tuple(draw(State(state), has_opponent=self.task == "hit") for state in states)

    def close_extras(self, **kwargs: Any) -> None:
        """Releases worlds and threads; called by ``close``."""
        if getattr(self, "_worlds", None) is not None:
            self._require_worlds().close()
            self._worlds = None

    def __getstate__(self) -> dict[str, Any]:
        state = self.__dict__.copy()
        worlds = state.pop("_worlds")
        if worlds is not None and self._sent is not None:
            raise OrderError("pickle: expected recv() of the step that was sent, got another call")
        state["_is_open"] = worlds is not None
        state["_saved"] = self.save() if worlds is not None and self._is_started else None
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        is_open, saved = state.pop("_is_open"), state.pop("_saved")
        self.__dict__.update(state)
        self._worlds = self._new_worlds() if is_open else None
        self._rows = self._new_rows()
        if saved is not None:
            self._is_started = False
            self.restore(saved)


def read_autoreset_mode(mode: AutoresetMode | str) -> AutoresetMode:
    """``mode`` as an AutoresetMode, given as a member or as its value."""
    values = [known.value for known in AutoresetMode]
    value = mode.value if isinstance(mode, Enum) else mode
    return AutoresetMode(one_of("autoreset_mode", value, values))


def available_cpus() -> int:
    """CPUs that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def read_seeds(seed: object, count: int, things: str) -> list[int | None]:
    """``seed`` as one seed per world or game: s as s, s + 1, …; None as no seeds; else a sequence, elements may be None."""
    if seed is None:
        return [None] * count
    if isinstance(seed, Sequence) and not isinstance(seed, (str, bytes)) or np.ndim(seed) == 1:  # type: ignore[arg-type]
        seeds = list(seed)  # type: ignore[call-overload]
        if len(seeds) != count:
            raise ArgumentError(f"seed: expected one for each of {count} {things}, got {len(seeds)}")
        return [None if value is None else seed_number(f"seed[{index}]", value) for index, value in enumerate(seeds)]
    try:
        first = seed_number("seed", seed)
    except ArgumentTypeError:
        raise ArgumentTypeError(
            f"seed: expected a whole number, or one for each of {count} {things}, got {seed!r:.80}"
        ) from None
    last = seed_number(f"seed + {count - 1}, the last of {count} {things}", first + count - 1)
    return list(range(first, last + 1))
