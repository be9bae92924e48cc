"""`air_hockey_challenge.utils.transformations`: between the table's frame and a robot's base frame."""

from __future__ import annotations

from typing import Any

import numpy as np

from faceoff.challenge_2023._arguments import Floats, array


def robot_to_world(base_frame: Any, translation: Any, rotation: Any = None) -> tuple[Floats, Floats]:
    """A point, and optionally a rotation, from the robot's base frame to the table's frame.

    Args:
        base_frame: a robot's base in the table's frame, (4, 4), one of `env_info["robot"]["base_frame"]`.
        translation: the point, (2,) or (3,), m.
        rotation: (3, 3); None for the robot's own axes.

    Returns:
        The point, in the shape of `translation`, and the rotation (3, 3).
    """
    return _transform(array("base_frame", base_frame, (4, 4)), translation, rotation)


def world_to_robot(base_frame: Any, translation: Any, rotation: Any = None) -> tuple[Floats, Floats]:
    """The inverse of `robot_to_world`, with the same arguments and results: from the table's frame to the robot's."""
    frame = array("base_frame", base_frame, (4, 4))
    inverse = np.eye(4)
    inverse[:3, :3] = frame[:3, :3].T
    inverse[:3, 3] = -frame[:3, :3].T @ frame[:3, 3]
    return _transform(inverse, translation, rotation)


def _transform(frame: Floats, translation: Any, rotation: Any) -> tuple[Floats, Floats]:
    point = array("translation", translation, (2,), (3,))
    turned = frame[:3, :3] if rotation is None else frame[:3, :3] @ array("rotation", rotation, (3, 3))
    # A point of two numbers is one at height 0.
    moved = frame[:3, : len(point)] @ point + frame[:3, 3]
    return moved[: len(point)], np.array(turned)
