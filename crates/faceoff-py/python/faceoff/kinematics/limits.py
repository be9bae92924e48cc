"""The rules' constraints on the robot, and joint speeds relative to their limits.

Constants come from `model`, and from `plain`, the kinematics in plain Python (without NumPy).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from . import model, plain
from .arrays import Floats, broadcast, joints
from .poses import forward, heights

# What the rules allow for each joint, ±: rad and rad/s.
_MAX_POSITION_RAD = model.LIMIT_FRACTION * np.array(model.POSITION_LIMIT_RAD)
_MAX_VELOCITY_RAD_S = model.LIMIT_FRACTION * np.array(model.VELOCITY_LIMIT_RAD_S)


class Constraints(NamedTuple):
    """The values of each group of constraints; above 0 is a violation.

    The rules' fifth group, computation time, does not concern the robot.
    """

    ee: Floats
    """(..., 5), m: too near, too far right, too far left, too low, too high."""
    link: Floats
    """(..., 2), m: how far elbow and wrist are below their minimum height."""
    joint_pos: Floats
    """(..., 14), rad: above 95 % of the upper limits, then below 95 % of the lower ones."""
    joint_vel: Floats
    """(..., 14), rad/s: above 95 % of the upper limits, then below 95 % of the lower ones."""

    def worst(self) -> dict[str, Floats]:
        """The largest value, shape (...), of each group, by the rules' keys."""
        return {name: values.max(axis=-1) for name, values in self._asdict().items()}


def constraints(q: ArrayLike, dq: ArrayLike) -> Constraints:
    """The constraints at joint positions (..., 7), rad, and velocities (..., 7), rad/s.

    The rules apply to the low-pass filtered velocities of the observation.
    """
    pose, rates = broadcast("q and dq", joints("q", q), joints("dq", dq))
    ee = forward(pose)
    x, y, z = ee[..., 0], ee[..., 1], ee[..., 2]
    low = model.EE_DESIRED_HEIGHT_M - model.EE_HEIGHT_TOLERANCE_M
    high = model.EE_DESIRED_HEIGHT_M + model.EE_HEIGHT_TOLERANCE_M
    over_table = [plain.X_MIN_M - x, -y - plain.Y_MAX_M, y - plain.Y_MAX_M, low - z, z - high]
    return Constraints(
        ee=np.stack(over_table, axis=-1),
        link=model.LINK_HEIGHT_M - heights(pose),
        joint_pos=np.concatenate([pose - _MAX_POSITION_RAD, -_MAX_POSITION_RAD - pose], axis=-1),
        joint_vel=np.concatenate([rates - _MAX_VELOCITY_RAD_S, -_MAX_VELOCITY_RAD_S - rates], axis=-1),
    )


def speed_share(dq: ArrayLike) -> Floats:
    """The largest joint velocity of (..., 7), rad/s, as a share (...) of the allowed one; above 1 is a violation."""
    return speed_share_unchecked(joints("dq", dq))


def speed_share_unchecked(dq: Floats) -> Floats:
    """`speed_share` without the check of its argument: (..., 7), rad/s, of any magnitude."""
    share: Floats = np.max(np.abs(dq) / _MAX_VELOCITY_RAD_S, axis=-1)
    return share
