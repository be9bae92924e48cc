"""Develop, train and evaluate agents for the robot air hockey competition.

Importing this package is cheap: the simulator and other packages are imported on first use.

- :mod:`faceoff.agent`: the protocol loop of an agent, standard library only.
- :mod:`faceoff.kinematics`: the robot's geometry.
- :mod:`faceoff.gym`: Gymnasium environments of the three tasks, with one world (a simulated table) or many.
- :mod:`faceoff.game`: the game of two robots, for PettingZoo and self-play.
- :mod:`faceoff.sb3`: the vector environment as Stable-Baselines3 expects it.
- :mod:`faceoff.dataset`: recorded episodes.
- :mod:`faceoff.challenge_2023`: agents that were written for the 2023 challenge.
- :func:`faceoff.evaluate`: the competition's evaluator with a policy in this process.
- :mod:`faceoff.actions`: the environments' actions and observations for agents, standard library only.
- :func:`faceoff.export`: makes an agent of a trained policy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from faceoff.errors import ArgumentError, ArgumentTypeError, ClosedError, Error, MissingError, OrderError

if TYPE_CHECKING:
    from faceoff._evaluate import evaluate
    from faceoff._export import export

__all__ = [
    "ArgumentError",
    "ArgumentTypeError",
    "ClosedError",
    "Error",
    "MissingError",
    "OrderError",
    "evaluate",
    "export",
]


def __getattr__(name: str) -> Any:
    if name == "evaluate":
        from faceoff._evaluate import evaluate

        return evaluate
    if name == "export":
        from faceoff._export import export

        return export
    if name == "__version__":
        from importlib.metadata import version

        from faceoff._distribution import DISTRIBUTION

        return version(DISTRIBUTION)
    raise AttributeError(f"module 'faceoff' has no attribute {name!r}")
