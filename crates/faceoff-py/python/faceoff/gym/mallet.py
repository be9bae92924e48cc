"""Actions that move the mallet over the table, instead of joints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.spaces import Box
from gymnasium.vector import VectorEnv, VectorWrapper
from gymnasium.vector.utils import batch_space

from faceoff import _native, kinematics
from faceoff._arguments import numbers
from faceoff.errors import ArgumentError

#: Where the mallet may go, m in the robot's base frame: [x, y] least and greatest. The constraint on the end effector
#: begins 2 cm beyond it, but towards the middle of the table, where the arm's reach ends.
REGION = ((0.605, -0.45), (1.30, 0.45))
CONTROL_STEP_S = 0.02
#: Of a joint's velocity limit; the constraint is 0.95, and an arm that is pushed on overshoots.
SPEED_SHARE = 0.8
#: Along each axis. An arm that is asked for more sags out of its height.
MAX_ACCELERATION_M_S2 = 8.0

Floats = npt.NDArray[np.float64]

if TYPE_CHECKING:
    ManyWorlds = VectorWrapper[Any, Any, Any, Any, Any]
else:
    # Not generic in Gymnasium 1.1.
    ManyWorlds = VectorWrapper


class MalletMotion:
    """Where the mallets of some worlds are commanded to be, and the joints that bring them there."""

    def __init__(self, worlds: int, max_speed_m_s: float) -> None:
        self._max_speed_m_s = max_speed_m_s
        self._start = np.array(_native.start_pose())
        self._step_limits = SPEED_SHARE * np.array(_native.joint_limits()[1]) * CONTROL_STEP_S
        self._q = np.tile(self._start, (worlds, 1))
        self._xy = kinematics.forward(self._q)[:, :2]
        self._speed = np.zeros((worlds, 2))

    def restart(self, which: npt.NDArray[np.bool_]) -> None:
        """These worlds begin an episode: their mallets are where they start."""
        self._q[which] = self._start
        self._xy[which] = kinematics.forward(self._start)[:2]
        self._speed[which] = 0.0

    def command(self, actions: Floats) -> Floats:
        """From (worlds, 2) fractions of the greatest speed along x and y to (worlds, 14) raw actions.

        A mallet that would be too fast for its joints, would gain speed too fast or would leave its region gets as far as
        it can.
        """
        least, greatest = np.array(REGION)
        wanted = np.clip(actions, -1.0, 1.0) * self._max_speed_m_s
        change_m_s = MAX_ACCELERATION_M_S2 * CONTROL_STEP_S
        speed = self._speed + np.clip(wanted - self._speed, -change_m_s, change_m_s)
        # So slow towards the region's edge that it can stop there.
        slow = np.sqrt(2.0 * MAX_ACCELERATION_M_S2 * np.maximum(self._xy - least, 0.0))
        fast = np.sqrt(2.0 * MAX_ACCELERATION_M_S2 * np.maximum(greatest - self._xy, 0.0))
        step = np.clip(speed, -slow, fast) * CONTROL_STEP_S
        step = np.clip(self._xy + step, least, greatest) - self._xy
        q, _ = kinematics.inverse(self._xy + step)
        excess = np.max(np.abs(q - self._q) / self._step_limits, axis=1, keepdims=True)
        # Shortened along the table, not in the joints, so that the mallet keeps its height.
        step /= np.maximum(excess, 1.0)
        q, is_good = kinematics.inverse(self._xy + step)
        step = np.where(is_good[:, None], step, 0.0)
        change = np.where(is_good[:, None], q - self._q, 0.0)
        self._xy = self._xy + step
        self._speed = step / CONTROL_STEP_S
        self._q = self._q + change
        return np.concatenate([self._q, change / CONTROL_STEP_S], axis=1)


def _check(space: gymnasium.Space[Any], action_mode: str) -> None:
    length = space.shape[-1]  # type: ignore[index]
    if action_mode != "raw" or length != 14:
        raise ArgumentError(
            "env: expected one made with action_mode='raw' and interpolation=3, whose actions are positions and "
            f"velocities, got one with {action_mode!r} and actions of {length} numbers"
        )


def _speed(value: float) -> float:
    if not 0.0 < value <= 5.0:
        raise ArgumentError(f"max_speed_m_s: expected a speed above 0 and up to 5, got {value}")
    return float(value)


class MalletPlane(gymnasium.ActionWrapper[Any, Any, Any]):
    """Actions (2,) in [-1, 1]: how fast the mallet moves along x and y, at its height over the table.

    Args:
        env: an :class:`AirHockeyEnv` with ``action_mode="raw"`` and ``interpolation=3``: without commanded velocities
            the arm lags and sags by centimetres.
        max_speed_m_s: what 1 stands for; joints that would be too fast for it slow the mallet down.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], max_speed_m_s: float = 1.0) -> None:
        super().__init__(env)
        _check(env.action_space, getattr(env.unwrapped, "action_mode", "none"))
        self._motion = MalletMotion(1, _speed(max_speed_m_s))
        self.action_space = Box(-1.0, 1.0, (2,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """As of the environment."""
        told = self.env.reset(seed=seed, options=options)
        self._motion.restart(np.ones(1, np.bool_))
        return told

    def action(self, action: Any) -> Floats:
        """The joints that follow, as a raw action."""
        given = numbers("action", action, (2,))
        if not np.isfinite(given).all():
            raise ArgumentError(f"action: expected finite numbers, got {given}")
        result: Floats = self._motion.command(given[None])[0]
        return result


class MalletPlaneVector(ManyWorlds):
    """:class:`MalletPlane` for an :class:`AirHockeyVectorEnv`; actions are (num_envs, 2)."""

    def __init__(self, env: VectorEnv[Any, Any, Any], max_speed_m_s: float = 1.0) -> None:
        super().__init__(env)
        _check(env.action_space, getattr(env.unwrapped, "action_mode", "none"))
        self._motion = MalletMotion(env.num_envs, _speed(max_speed_m_s))
        self.single_action_space = Box(-1.0, 1.0, (2,), np.float32)
        self.action_space = batch_space(self.single_action_space, env.num_envs)
        self._ended = np.zeros(env.num_envs, np.bool_)

    def reset(
        self, *, seed: Any = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """As of the environment."""
        told = self.env.reset(seed=seed, options=options)
        is_reset = np.ones(self.num_envs, np.bool_)
        if options is not None and options.get("reset_mask") is not None:
            is_reset = options["reset_mask"]
        self._motion.restart(is_reset)
        self._ended[is_reset] = False
        return told

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """As of the environment."""
        given = numbers("actions", actions, (self.num_envs, 2))
        if not np.isfinite(given).all():
            world, index = np.argwhere(~np.isfinite(given))[0]
            raise ArgumentError(
                f"actions: expected finite numbers, got {given[world, index]} at index {index} of world {world}"
            )
        told = self.env.step(self._motion.command(given))
        ended = told[2] | told[3]
        same_step = self.env.metadata["autoreset_mode"].name == "SAME_STEP"
        # Whose world has begun an episode with this step.
        self._motion.restart(ended if same_step else self._ended)
        self._ended = ended.copy()
        return told
