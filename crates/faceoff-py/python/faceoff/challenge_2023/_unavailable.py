"""Names of the package of 2023 that agents import but do not need to play: simulator, training and evaluation.

They can be imported, because many agents import them beside `AgentBase`; using one ends in an error.
"""

from __future__ import annotations

from typing import Any

from faceoff.errors import MissingError


def missing(name: str, advice: str) -> MissingError:
    """The error for a part of the package of 2023 that a bundle does not have."""
    return MissingError(
        f"{name}: expected a part of air_hockey_challenge that plays, got one that simulates, trains or "
        f"evaluates; {advice}"
    )


class AirHockeyChallengeWrapper:
    """The simulator of 2023, refused when it is created."""

    def __init__(self, *_: Any, **__: Any) -> None:
        raise missing("AirHockeyChallengeWrapper", "train with the environments of faceoff.gym (docs/python.md)")


class ChallengeCore:
    """The training loop of 2023, refused when it is created."""

    def __init__(self, *_: Any, **__: Any) -> None:
        raise missing("ChallengeCore", "train with the environments of faceoff.gym (docs/python.md)")


def evaluate(*_: Any, **__: Any) -> None:
    """The evaluation of 2023, refused."""
    raise missing("evaluate", "evaluate the bundle with `faceoff eval`")


def run_tournament(*_: Any, **__: Any) -> None:
    """The game of 2023, refused."""
    raise missing("run_tournament", "play bundles against each other with `faceoff play`")


#: Penalty points per episode for each kind of violation, in the terms of 2023.
PENALTY_POINTS = {
    "joint_pos_constr": 2,
    "ee_constr": 3,
    "link_constr": 3,
    "joint_vel_constr": 1,
    "computation_time_minor": 0.5,
    "computation_time_middle": 1,
    "computation_time_major": 2,
}
