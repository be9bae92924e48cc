"""Wrappers of environments whose actions are mallet velocities in the plane of the table, instead of joint commands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import VectorEnv, VectorWrapper
from gymnasium.vector.utils import batch_space

from faceoff._arguments import numbers, real
from faceoff.errors import ArgumentError
from faceoff.kinematics import native
from faceoff.kinematics.arrays import Floats
from faceoff.kinematics.mallet import MalletMotion

if TYPE_CHECKING:
    VectorWrapperBase = VectorWrapper[Any, Any, Any, Any, Any]
else:
    # Not generic in Gymnasium 1.1.
    VectorWrapperBase = VectorWrapper


#: The largest mallet speed of an action of 1.
MAX_SPEED_M_S = 5.0


def _check_env(space: gymnasium.Space[Any], action_mode: str) -> None:
    length = space.shape[-1]  # type: ignore[index]
    if action_mode != "raw" or length != 14:
        raise ArgumentError(
            "env: expected one made with action_mode='raw' and interpolation=3, whose actions are positions and "
            f"velocities, got one with {action_mode!r} and actions of {length} numbers"
        )


class MalletPlane(gymnasium.ActionWrapper[Any, Any, Any]):
    """Actions (2,) in [-1, 1]: the mallet's velocity along x and y, as shares of ``max_speed_m_s``, at constant height.

    Args:
        env: an :class:`AirHockeyEnv` with ``action_mode="raw"`` and ``interpolation=3``: without commanded velocities
            the arm lags and sags by centimetres.
        max_speed_m_s: mallet speed of an action of 1; the mallet moves slower where a joint's speed limit requires it.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], max_speed_m_s: float = 1.0) -> None:
        super().__init__(env)
        _check_env(env.action_space, getattr(env.unwrapped, "action_mode", "none"))
        self.max_speed_m_s = real("max_speed_m_s", max_speed_m_s, 0.0, MAX_SPEED_M_S)
        self.motion = MalletMotion(1, self.max_speed_m_s, native.inverse)
        self.action_space = Box(-1.0, 1.0, (2,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Like the method of the wrapped environment."""
        result = self.env.reset(seed=seed, options=options)
        self.motion.restart(np.ones(1, np.bool_))
        return result

    def action(self, action: Any) -> Floats:
        """The raw action, (14,): joint positions (rad) and velocities (rad/s) that follow the mallet's velocity."""
        checked = numbers("action", action, (2,))
        if not np.isfinite(checked).all():
            raise ArgumentError(f"action: expected finite numbers, got {checked}")
        command: Floats = self.motion.command(checked[None])[0]
        return command


class MalletPlaneVector(VectorWrapperBase):
    """:class:`MalletPlane` for an :class:`AirHockeyVectorEnv`; actions are (num_envs, 2)."""

    def __init__(self, env: VectorEnv[Any, Any, Any], max_speed_m_s: float = 1.0) -> None:
        super().__init__(env)
        _check_env(env.action_space, getattr(env.unwrapped, "action_mode", "none"))
        self.max_speed_m_s = real("max_speed_m_s", max_speed_m_s, 0.0, MAX_SPEED_M_S)
        self.motion = MalletMotion(env.num_envs, self.max_speed_m_s, native.inverse)
        self.single_action_space = Box(-1.0, 1.0, (2,), np.float32)
        self.action_space = batch_space(self.single_action_space, env.num_envs)
        self._ended = np.zeros(env.num_envs, np.bool_)

    def reset(
        self, *, seed: Any = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Like the method of the wrapped environment."""
        result = self.env.reset(seed=seed, options=options)
        is_reset = np.ones(self.num_envs, np.bool_)
        if options is not None and options.get("reset_mask") is not None:
            is_reset = options["reset_mask"]
        self.motion.restart(is_reset)
        self._ended[is_reset] = False
        return result

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Like the method of the wrapped environment."""
        return self._restart_motions(self.env.step(self._command(actions)))

    def send(self, actions: Any) -> None:
        """Like the method of :class:`AirHockeyVectorEnv`, which this wrapper has to wrap directly."""
        self.env.send(self._command(actions))  # type: ignore[attr-defined]

    def recv(self) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Waits for the step that :meth:`send` began, and returns its result."""
        return self._restart_motions(self.env.recv())  # type: ignore[attr-defined]

    def _command(self, actions: Any) -> Floats:
        checked = numbers("actions", actions, (self.num_envs, 2))
        if not np.isfinite(checked).all():
            world, index = np.argwhere(~np.isfinite(checked))[0]
            raise ArgumentError(
                f"actions: expected finite numbers, got {checked[world, index]} at index {index} of world {world}"
            )
        return self.motion.command(checked)

    def _restart_motions(self, result: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        ended = result[2] | result[3]
        same_step = self.env.metadata["autoreset_mode"].name == "SAME_STEP"
        # Motions of the worlds in which this step began an episode.
        self.motion.restart(ended if same_step else self._ended)
        self._ended = ended.copy()
        return result  # type: ignore[no-any-return]
