"""Gymnasium environments of the three tasks: hit, defend and prepare.

Importing this module registers ``faceoff/AirHockey-Hit-v0``, ``faceoff/AirHockey-Defend-v0`` and
``faceoff/AirHockey-Prepare-v0``::

    import gymnasium, faceoff.gym
    env = gymnasium.make("faceoff/AirHockey-Defend-v0", profile="evaluation")
    envs = gymnasium.make_vec("faceoff/AirHockey-Defend-v0", num_envs=256)

Arguments of ``make`` are those of :class:`AirHockeyEnv`, of ``make_vec`` those of :class:`AirHockeyVectorEnv`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

try:
    import gymnasium
except ImportError as error:  # pragma: no cover - depends on what is installed
    from faceoff._distribution import install_command
    from faceoff.errors import MissingError

    raise MissingError(f"faceoff.gym needs gymnasium: {install_command('gym')}") from error

from faceoff.gym.env import AirHockeyEnv
from faceoff.gym.reward import CONSTRAINTS, Reward, State, Transition
from faceoff.gym.vector import AirHockeyVectorEnv

if TYPE_CHECKING:
    from faceoff.gym.mallet import MalletPlane, MalletPlaneVector

__all__ = [
    "CONSTRAINTS",
    "AirHockeyEnv",
    "AirHockeyVectorEnv",
    "MalletPlane",
    "MalletPlaneVector",
    "Reward",
    "State",
    "Transition",
]


def __getattr__(name: str) -> Any:
    if name in ("MalletPlane", "MalletPlaneVector"):
        from faceoff.gym import mallet

        return getattr(mallet, name)
    raise AttributeError(f"module 'faceoff.gym' has no attribute {name!r}")


def _register() -> None:
    for task in ("hit", "defend", "prepare"):
        identifier = f"faceoff/AirHockey-{task.capitalize()}-v0"
        if identifier not in gymnasium.registry:
            gymnasium.register(
                identifier,
                entry_point="faceoff.gym.env:AirHockeyEnv",
                vector_entry_point="faceoff.gym.vector:AirHockeyVectorEnv",
                kwargs={"task": task},
            )


_register()
