"""The environment of one world, a simulated table with one robot, or two in `hit`."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.wrappers import OrderEnforcing, PassiveEnvChecker, TimeLimit

from faceoff import _native
from faceoff._arguments import (
    ActionMode,
    Task,
    flag,
    integer,
    interpolation_code,
    numbers,
    one_of,
    seed_number,
    write_setup,
)
from faceoff.errors import ArgumentError, ArgumentTypeError, ClosedError
from faceoff.gym.reward import Reward, State, Transition
from faceoff.gym.rows import Rows
from faceoff.gym.spaces import action_space, observation_space
from faceoff.gym.call_guard import CallGuard, exclusive

Observation = npt.NDArray[np.float32]

#: Keys of the options of ``reset``.
OPTIONS = ("episode", "puck")


class AirHockeyEnv(gymnasium.Env[Any, Any]):
    """A task of the qualifying stage.

    Args:
        task: ``hit``, ``defend`` or ``prepare``.
        interpolation: how an action becomes a trajectory: 1, 2, 3, 4, 5, -1 or None (docs/protocol.md); the action has
            7, 7, 14, 14, 21, 14 or 420 numbers.
        action_mode: ``delta``, ``absolute`` or ``raw`` (docs/python.md, "Actions").
        clip_actions: clip numbers to their bounds instead of refusing them.
        profile: perturbations of the world: the name of a profile, or names of perturbations.
        perturbations: magnitudes that replace those of the ruleset, as in ``{"tracking_loss": {"probability": 0.0}}``.
        mismatch_seed: seed of the arm's deviation from its model, if that perturbation is active; by default it follows from
            the seed of ``reset``, so that each seed has its own robot.
        max_episode_steps: control steps after which an episode is truncated, at most 500.
        reward: from a :class:`~faceoff.gym.reward.Transition` to a number, instead of the default reward.
        render_mode: ``rgb_array``, ``human`` or None.

    Episodes are those of the competition's evaluator: ``reset(seed=s)`` begins episode 0 of ``faceoff eval --seed s``,
    each ``reset()`` the next one. ``options={"episode": 7}`` selects an episode,
    ``options={"puck": [x, y, yaw, vx, vy, yaw_rate]}`` (table's frame; m, rad and s) sets the puck's initial state.
    """

    metadata: ClassVar[dict[str, Any]] = {  # type: ignore[misc]
        "render_modes": ["rgb_array", "human"],
        "render_fps": 50,
    }

    def __init__(
        self,
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
        render_mode: str | None = None,
    ) -> None:
        self._arguments: dict[str, Any] = {
            "task": task,
            "interpolation": interpolation,
            "action_mode": action_mode,
            "clip_actions": clip_actions,
            "profile": profile,
            "perturbations": perturbations,
            "mismatch_seed": mismatch_seed,
            "max_episode_steps": max_episode_steps,
        }
        self._setup = write_setup(**self._arguments)
        if render_mode is not None:
            one_of("render_mode", render_mode, self.metadata["render_modes"])
        if reward is not None and not callable(reward):
            raise ArgumentTypeError(f"reward: expected a function of a Transition, got {reward!r}")
        self.task = task
        self.action_mode = action_mode
        self.interpolation = interpolation_code(interpolation)
        self.clip_actions = flag("clip_actions", clip_actions)
        self.render_mode = render_mode
        self.observation_space = observation_space(task)
        self.action_space = action_space(interpolation, action_mode)
        self._action_shape = self.action_space.shape
        self._reward = reward
        self._window: Any = None
        self._worlds: _native.Worlds | None = _native.Worlds(self._setup, 1, 1, "disabled")
        self._calls = CallGuard()
        self._is_started = False
        self._rows = self._new_rows()

    def _new_rows(self) -> Rows:
        length = self.observation_space.shape[0]  # type: ignore[index]
        return Rows.make(1, length, final_observations=False, states=self._reward is not None)

    def _require_worlds(self) -> _native.Worlds:
        if self._worlds is None:
            raise ClosedError("expected an open environment, got one that was closed: make a new one")
        return self._worlds

    @exclusive
    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begins an episode. Returns its first observation, and info with ``seed`` and ``episode_number``."""
        worlds = self._require_worlds()
        if seed is not None:
            seed = seed_number("seed", seed)
        number, puck = read_options(options)
        super().reset(seed=seed)
        if seed is None and not self._is_started:
            seed = int(self.np_random.integers(2**63))
        setup = self._setup_with(find_time_limit(self))
        if setup != self._setup:
            worlds = _native.Worlds(setup, 1, 1, "disabled")
            if seed is None:
                # New worlds do not know which episode was the last one.
                [(seed, last)] = self._require_worlds().origins()
                number = last + 1 if number is None else number
        all_worlds = np.ones(1, np.bool_)
        worlds.reset(all_worlds, [seed], number, puck, self._rows.arrays())
        self._worlds, self._setup = worlds, setup
        self._is_started = True
        self._render_human()
        return self._rows.observations[0].copy(), self._origin()

    def _setup_with(self, time_limit: int | None) -> str:
        """The setup of worlds whose episodes also end after this many steps."""
        own = self._arguments["max_episode_steps"]
        limits = [int(steps) for steps in (own, time_limit) if steps is not None]
        return write_setup(**self._arguments | {"max_episode_steps": min(limits, default=None)})

    @exclusive
    def step(
        self, action: Any
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One control step, 20 ms.

        Info has ``constraints``, 4 values in the order of :data:`faceoff.gym.CONSTRAINTS`, and at the end of
        an episode ``success``, ``end`` (the reason), ``violations`` (4 bools) and ``steps``.
        """
        worlds = self._require_worlds()
        checked = numbers("action", action, self._action_shape)  # type: ignore[arg-type]
        rows = self._rows
        before = None if self._reward is None else (rows.observations[0].copy(), rows.next_states[0].copy())
        worlds.step(checked.reshape(1, -1), rows.arrays())
        terminated, truncated = bool(rows.terminated[0]), bool(rows.truncated[0])
        info: dict[str, Any] = {"constraints": rows.constraints[0]}
        if terminated or truncated:
            info["success"] = bool(rows.success[0])
            info["end"] = _native.ENDS[rows.ends[0]]
            info["violations"] = rows.violations[0]
            info["steps"] = int(rows.steps[0])
        reward = float(rows.rewards[0])
        if self._reward is not None and before is not None:
            transition = Transition(
                observation=before[0],
                action=checked,
                next_observation=rows.observations[0].copy(),
                state=State(before[1]),
                next_state=State(rows.states[0].copy()),
                constraints=info["constraints"],
                violations=rows.violations[0],
                success=rows.success[0],
                terminated=rows.terminated[0],
                truncated=rows.truncated[0],
            )
            reward = check_reward(self._reward(transition))
        self._render_human()
        return rows.observations[0].copy(), reward, terminated, truncated, info

    @exclusive
    def save(self) -> _native.Snapshot:
        """The exact state of the world; it can be pickled."""
        return self._require_worlds().save(0)

    @exclusive
    def restore(self, state: _native.Snapshot) -> tuple[Observation, dict[str, Any]]:
        """Restores a saved state of this environment, or of another one with the same arguments.

        Returns the observation of that state, and info as :meth:`reset` does.
        """
        if not isinstance(state, _native.Snapshot):
            raise ArgumentTypeError(f"state: expected what save() returned, got {state!r:.80}")
        worlds = self._require_worlds()
        setup = self._setup_with(state.max_episode_steps)
        if setup != self._setup:
            worlds = _native.Worlds(setup, 1, 1, "disabled")
        worlds.restore(0, state, self._rows.arrays())
        self._worlds, self._setup, self._is_started = worlds, setup, True
        return self._rows.observations[0].copy(), self._origin()

    @property
    def state(self) -> State:
        """The present true state."""
        return State(np.array(self._require_worlds().state(0)))

    def _origin(self) -> dict[str, Any]:
        [(seed, number)] = self._require_worlds().origins()
        return {"seed": seed, "episode_number": number}

    def render(self) -> npt.NDArray[np.uint8] | None:  # type: ignore[override]
        """A picture of the table from above, (360, 640, 3) uint8; None for ``human``, which shows a window."""
        if self.render_mode is None:
            raise ArgumentError(
                "render: expected an environment made with render_mode='rgb_array' or 'human', got None"
            )
        from faceoff.gym.render import draw

        frame = draw(self.state, has_opponent=self.task == "hit")
        if self.render_mode == "rgb_array":
            return frame
        if self._window is None:
            from faceoff.gym.window import Window

            self._window = Window(f"faceoff {self.task}", self.metadata["render_fps"])
        self._window.show(frame)
        return None

    def _render_human(self) -> None:
        if self.render_mode == "human":
            self.render()

    def close(self) -> None:
        """Releases the world and the window; may be called more than once."""
        if self._worlds is not None:
            self._worlds.close()
            self._worlds = None
        if self._window is not None:
            self._window.close()
            self._window = None

    def __getstate__(self) -> dict[str, Any]:
        state = self.__dict__.copy()
        worlds = state.pop("_worlds")
        state["_window"] = None
        state["_is_open"] = worlds is not None
        state["_saved"] = worlds.save(0) if worlds is not None and self._is_started else None
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        is_open, saved = state.pop("_is_open"), state.pop("_saved")
        self.__dict__.update(state)
        self._worlds = _native.Worlds(self._setup, 1, 1, "disabled") if is_open else None
        self._rows = self._new_rows()
        if saved is not None:
            self.restore(saved)


def find_time_limit(env: AirHockeyEnv) -> int | None:
    """The number of steps of the ``TimeLimit`` of ``gymnasium.make`` around this environment, whose ``reset`` is under way.

    ``make(max_episode_steps=…)`` does not hand its argument to the environment, but wraps it. The environment must
    know the limit, because the last step's info says how the episode ended. The wrapper calls this environment's
    ``reset``, so it is found among the callers. A limit outside of other wrappers does not apply here: those wrappers
    may repeat actions.
    """
    frame = sys._getframe(1)
    while frame is not None:
        wrapper = frame.f_locals.get("self") if frame.f_code.co_name == "reset" else None
        if isinstance(wrapper, TimeLimit) and _wraps_directly(wrapper, env):
            return integer("max_episode_steps", wrapper._max_episode_steps, 1, _native.EPISODE_STEPS)
        frame = frame.f_back  # type: ignore[assignment]
    return None


def _wraps_directly(wrapper: gymnasium.Env[Any, Any], env: AirHockeyEnv) -> bool:
    """Whether there are only checks between them, which ``gymnasium.make`` adds."""
    inner = wrapper.env  # type: ignore[attr-defined]
    while isinstance(inner, (OrderEnforcing, PassiveEnvChecker)):
        inner = inner.env
    return inner is env


def read_options(options: Mapping[str, Any] | None) -> tuple[int | None, list[float] | None]:
    """The episode's number and the puck's initial state of ``reset``'s options, each None if it is absent."""
    if options is None:
        return None, None
    if not isinstance(options, Mapping):
        raise ArgumentTypeError(f"options: expected a mapping, got {options!r:.80}")
    unknown = [name for name in options if name not in OPTIONS]
    if unknown:
        raise ArgumentError(f"options: expected {' and '.join(OPTIONS)}, got {unknown[0]!r}")
    number = options.get("episode")
    if number is not None:
        number = integer("options['episode']", number, 0, 2**32 - 1)
    puck = options.get("puck")
    if puck is not None:
        puck = numbers("options['puck']", puck, (6,)).tolist()
    return number, puck


def check_reward(value: Any) -> float:
    """The return value of a reward function as a float; refused unless it is a finite number."""
    try:
        reward = float(value)
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"reward: expected a function that returns a number, got {value!r:.80}") from None
    if not np.isfinite(reward):
        raise ArgumentError(f"reward: expected a finite number, got {reward}")
    return reward
