"""Reads an environment: what it and its wrappers do with observations and actions between a policy and the arm."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv

from faceoff._arguments import TASKS, Task, one_of
from faceoff._export.steps import Step, clip, normalise
from faceoff.errors import ArgumentError, ArgumentTypeError
from faceoff.gym.env import AirHockeyEnv
from faceoff.gym.mallet import MalletPlane, MalletPlaneVector
from faceoff.gym.vector import AirHockeyVectorEnv
from faceoff.sb3 import VecEnvMethods

#: Wrappers that change neither observations nor actions. Their classes differ between versions of the libraries.
TRANSPARENT = {
    "gymnasium": (
        "Autoreset",
        "DictInfoToList",
        "HumanRendering",
        "NormalizeReward",
        "OrderEnforcing",
        "PassiveEnvChecker",
        "RecordEpisodeStatistics",
        "RecordVideo",
        "RenderCollection",
        "TimeLimit",
    ),
    "stable_baselines3": ("Monitor", "VecCheckNan", "VecMonitor", "VecVideoRecorder"),
}
#: What to do about a vector environment whose worlds are in other processes.
SUBPROCESSES = "pass env=, one such environment with the same wrappers in this process"
#: What to do about a wrapper whose effect is unknown.
CURE = "put what it does into the policy, and pass env=, the environment below this wrapper"


@dataclass
class PolicyEnvironment:
    """What a policy was trained with."""

    task: Task
    action_mode: str
    interpolation: int | None
    clip_actions: bool
    observation_space: Box
    """Of the simulated world, below all wrappers."""
    action_space: Box
    """What the world, or the wrapper with mallet actions, expects."""
    mallet_speed_m_s: float | None = None
    """The maximum speed if actions are mallet velocities."""
    observation_steps: list[Step] = field(default_factory=list)
    """From the world's observation to the policy's."""
    action_steps: list[Step] = field(default_factory=list)
    """From the policy's action to the world's."""
    frames: int = 1
    """Number of the last observations that the policy gets, the newest at the end; zeros before the first one."""

    @property
    def observation_len(self) -> int:
        """Count of numbers in the policy's input."""
        return self.frames * int(self.observation_space.shape[0])

    @property
    def action_len(self) -> int:
        """Count of numbers in an action."""
        return int(self.action_space.shape[0])

    @property
    def action_limit(self) -> float | None:
        """The largest magnitude that the environment accepts; None if it clips."""
        if self.clip_actions or self.mallet_speed_m_s is not None:
            return None
        return 1e4 if self.action_mode == "raw" else 1.0


@dataclass
class Layer:
    """What a wrapper does."""

    inner: Any
    """The environment that it wraps."""
    observation_steps: list[Step] = field(default_factory=list)
    action_steps: list[Step] = field(default_factory=list)
    frames: int = 1
    """Number of observations that it stacks."""


def default_environment(task: object) -> PolicyEnvironment:
    """The environment of a task with default arguments, without wrappers."""
    one_of("task", task, TASKS)
    return read_environment(AirHockeyEnv(task), task)  # type: ignore[arg-type]


def read_environment(env: Any, task: object = None) -> PolicyEnvironment:
    """Reads wrappers from the outermost inwards, then the world.

    Raises:
        ArgumentError, ArgumentTypeError: for a wrapper whose effect cannot be read, for another environment, or for a
            `task` that is not the environment's.
    """
    observation_steps: list[Step] = []
    action_steps: list[Step] = []
    mallet: MalletPlane | MalletPlaneVector | None = None
    # Number of stacked observations, and the name of the wrapper that stacks them, "" without one.
    frames, stack = 1, ""
    # From here on `env` is the environment that is read next; at the end it is the world.
    while not isinstance(env, (AirHockeyEnv, AirHockeyVectorEnv)):
        layer = _read_layer(env)
        if isinstance(env, (MalletPlane, MalletPlaneVector)):
            mallet = env
        elif layer.action_steps and mallet is not None:
            raise ArgumentError(f"env: expected no {_name(env)} below {_name(mallet)}: put it above, or leave it out")
        if stack and (layer.observation_steps or layer.frames > 1):
            raise ArgumentError(f"env: expected no {_name(env)} below {stack}: put it above, or leave it out")
        if layer.frames > 1:
            frames, stack = layer.frames, _name(env)
        observation_steps = [*layer.observation_steps, *observation_steps]
        action_steps += layer.action_steps
        env = layer.inner
    own = AirHockeyEnv if isinstance(env, AirHockeyEnv) else AirHockeyVectorEnv
    if type(env).step is not own.step or type(env).reset is not own.reset:
        raise ArgumentError(f"env: expected an {own.__name__}, got {_name(env)} with a step or reset of its own: {CURE}")
    if task is not None and one_of("task", task, TASKS) != env.task:
        raise ArgumentError(f"task: expected {env.task}, the task of env, got {task!r}")
    return PolicyEnvironment(
        task=env.task,
        action_mode=env.action_mode,
        interpolation=env.interpolation,
        clip_actions=env.clip_actions,
        observation_space=_single_space(env, "observation_space"),
        action_space=_single_space(env if mallet is None else mallet, "action_space"),
        mallet_speed_m_s=None if mallet is None else mallet.max_speed_m_s,
        observation_steps=observation_steps,
        action_steps=action_steps,
        frames=frames,
    )


def _read_layer(env: Any) -> Layer:
    """What a wrapper or a vector environment does."""
    if "stable_baselines3" in sys.modules:
        from faceoff._export.stable_baselines3 import read_vec_env_layer

        read = read_vec_env_layer(env)
        if read is not None:
            return read
    if isinstance(env, VecEnvMethods):
        return Layer(env.envs)
    if isinstance(env, SyncVectorEnv):
        return Layer(env.envs[0])
    if isinstance(env, AsyncVectorEnv):
        raise ArgumentError(f"env: expected worlds in this process, got an AsyncVectorEnv: {SUBPROCESSES}")
    if not isinstance(env, (gymnasium.Wrapper, gymnasium.vector.VectorWrapper)):
        raise ArgumentTypeError(
            f"env: expected an environment of faceoff.gym or faceoff.sb3, with or without wrappers, got {env!r:.80}"
        )
    if isinstance(env, (MalletPlane, MalletPlaneVector)) or is_transparent(env):
        return Layer(env.env)
    if _is_gymnasium_wrapper(env, "NormalizeObservation"):
        statistics: Any = env
        rms = statistics.obs_rms
        return Layer(env.env, normalise(rms.mean, rms.var, statistics.epsilon, None))
    if _is_gymnasium_wrapper(env, "FlattenObservation") and len(_single_space(env.env, "observation_space").shape) == 1:
        return Layer(env.env)
    inner = _single_space(env.env, "action_space")
    if _is_gymnasium_wrapper(env, "ClipAction"):
        return Layer(env.env, action_steps=clip(inner.low, inner.high))
    if _is_gymnasium_wrapper(env, "RescaleAction"):
        return Layer(env.env, action_steps=_rescale(_single_space(env, "action_space"), inner))
    if _is_gymnasium_wrapper(env, "TransformObservation") or _is_gymnasium_wrapper(env, "TransformAction"):
        raise ArgumentError(f"env: expected wrappers that can be read, got {_name(env)} with a function: {CURE}")
    raise ArgumentError(f"env: expected wrappers that can be exported, got {_name(env)}: {CURE}")


def is_transparent(env: Any) -> bool:
    """Whether a wrapper changes neither observations nor actions."""
    for library, names in TRANSPARENT.items():
        if type(env).__name__ in names and type(env).__module__.startswith(f"{library}."):
            return True
    if isinstance(env, (gymnasium.RewardWrapper, gymnasium.vector.VectorRewardWrapper)):
        return True
    for base in (gymnasium.Wrapper, gymnasium.vector.VectorWrapper):
        if isinstance(env, base):
            is_same = all(getattr(type(env), name) is getattr(base, name) for name in ("step", "reset"))
            return is_same and env.observation_space == env.env.observation_space
    return False


def _is_gymnasium_wrapper(env: Any, name: str) -> bool:
    """Whether an environment is the wrapper of this name in Gymnasium, for one world or for many."""
    return type(env).__name__ == name and type(env).__module__.startswith("gymnasium.")


def _rescale(outer: Box, inner: Box) -> list[Step]:
    """Converts actions from the bounds of `outer` to those of `inner`, in the operations of Gymnasium."""
    gradient = ((outer.high - outer.low) / (inner.high.astype(np.float64) - inner.low)).astype(inner.dtype)
    intercept = (gradient * -inner.low + outer.low).astype(inner.dtype)
    return [Step("Sub", intercept), Step("Div", gradient)]


def _single_space(env: Any, name: str) -> Box:
    """The space of one world."""
    space = getattr(env, f"single_{name}", None) or getattr(env, name)
    if not isinstance(space, Box):
        raise ArgumentError(f"env: expected a Box as {name}, got {space!r:.80} of {_name(env)}")
    return space


def _name(env: object) -> str:
    return type(env).__name__
