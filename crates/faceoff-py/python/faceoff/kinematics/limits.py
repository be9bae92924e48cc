"""The rules' constraints on the robot, and how near its limits a command is."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from faceoff.kinematics import model, plain
from faceoff.kinematics.arrays import Floats, joints, together
from faceoff.kinematics.poses import forward, heights

_POSITION = model.LIMIT_FRACTION * np.array(model.POSITION_LIMIT_RAD)
_VELOCITY = model.LIMIT_FRACTION * np.array(model.VELOCITY_LIMIT_RAD_S)


class Constraints(NamedTuple):
    """The values of each group of constraints; above 0 is a violation.

    The rules' fifth group, computation time, is not the robot's.
    """

    ee: Floats
    """(..., 5), m: too near, too far right, too far left, too low, too high."""
    link: Floats
    """(..., 2), m: elbow and wrist below their least height."""
    joint_pos: Floats
    """(..., 14), rad: above 95 % of the upper limits, then below 95 % of the lower ones."""
    joint_vel: Floats
    """(..., 14), rad/s: above 95 % of the upper limits, then below 95 % of the lower ones."""

    def worst(self) -> dict[str, Floats]:
        """The largest value (...) of each group, by the rules' keys."""
        return {name: values.max(axis=-1) for name, values in self._asdict().items()}


def constraints(q: ArrayLike, dq: ArrayLike) -> Constraints:
    """The constraints at joint positions (..., 7), rad, and velocities (..., 7), rad/s.

    The rules look at the low-pass filtered velocities, as the observation has them.
    """
    pose, rates = together("q and dq", joints("q", q), joints("dq", dq))
    ee = forward(pose)
    x, y, z = ee[..., 0], ee[..., 1], ee[..., 2]
    low = model.EE_DESIRED_HEIGHT_M - model.EE_HEIGHT_TOLERANCE_M
    high = model.EE_DESIRED_HEIGHT_M + model.EE_HEIGHT_TOLERANCE_M
    over_table = [plain.X_MIN_M - x, -y - plain.Y_MAX_M, y - plain.Y_MAX_M, low - z, z - high]
    return Constraints(
        ee=np.stack(over_table, axis=-1),
        link=model.LINK_HEIGHT_M - heights(pose),
        joint_pos=np.concatenate([pose - _POSITION, -_POSITION - pose], axis=-1),
        joint_vel=np.concatenate([rates - _VELOCITY, -_VELOCITY - rates], axis=-1),
    )


def speed_share(dq: ArrayLike) -> Floats:
    """The largest of joint velocities (..., 7), rad/s, as a share (...) of what the rules allow; above 1 they do not."""
    return share_of(joints("dq", dq))


def share_of(dq: Floats) -> Floats:
    """`speed_share` of velocities that are not an argument of the user's, however large."""
    share: Floats = np.max(np.abs(dq) / _VELOCITY, axis=-1)
    return share
