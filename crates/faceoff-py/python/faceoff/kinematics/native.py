"""Forward and inverse kinematics, velocities and constraints for batches, computed by the package's compiled half.

The functions have the names, arguments and errors of those in `faceoff.kinematics`; results agree up to rounding. They
are faster, `inverse` above all, and release the interpreter's lock. The same arguments give the same bits on every
machine, alone or in a batch. `speed_share` is the NumPy function; trajectories are only in `faceoff.kinematics`.

A bundle that uses this module contains the compiled half, as `faceoff.export` writes it for mallet actions.
`faceoff.kinematics` imports neither it nor this module.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from faceoff import _native
from . import model
from .arrays import Floats, broadcast, joints, points
from .limits import Constraints, speed_share

__all__ = [
    "Constraints",
    "constraints",
    "forward",
    "frames",
    "heights",
    "inverse",
    "jacobian",
    "posture_velocities",
    "speed_share",
    "velocities",
]


def forward(q: ArrayLike) -> Floats:
    """The end effector at joint positions `q` (..., 7), rad: (..., 3), m, base frame."""
    pose = _contiguous(joints("q", q))
    ee = np.empty((*pose.shape[:-1], 3))
    _native.arm_forward(pose, ee)
    return ee


def jacobian(q: ArrayLike) -> Floats:
    """How the end effector's x, y, z change with each joint at `q` (..., 7), rad: (..., 3, 7), m/rad."""
    pose = _contiguous(joints("q", q))
    jacobians = np.empty((*pose.shape[:-1], 3, model.JOINTS))
    _native.arm_jacobian(pose, jacobians)
    return jacobians


def heights(q: ArrayLike) -> Floats:
    """Heights of elbow and wrist (the origins of links 4 and 7) at `q` (..., 7), rad: (..., 2), m."""
    pose = _contiguous(joints("q", q))
    elbow_and_wrist = np.empty((*pose.shape[:-1], 2))
    _native.arm_heights(pose, elbow_and_wrist)
    return elbow_and_wrist


def frames(q: ArrayLike) -> tuple[Floats, Floats]:
    """Origins (..., 8, 3), m, and rotations (..., 8, 3, 3) of links 1…7 and the end effector at `q` (..., 7), rad.

    The columns of a rotation are the frame's axes in the base frame; joint i turns about the third one.
    """
    pose = _contiguous(joints("q", q))
    leading = pose.shape[:-1]
    origins = np.empty((*leading, model.JOINTS + 1, 3))
    rotations = np.empty((*leading, model.JOINTS + 1, 3, 3))
    _native.arm_frames(pose, origins, rotations)
    return origins, rotations


def inverse(target: ArrayLike, q0: ArrayLike | None = None) -> tuple[Floats, NDArray[np.bool_]]:
    """Joint positions (..., 7), rad, that put the end effector at points, and (...) whether they do within bounds.

    `target` is (..., 2), at the mallet's height, or (..., 3); m, base frame. Without `q0` the result is the point's
    posture, in closed form; with `q0` (..., 7), rad, it is a pose near it, by damped least squares. Bounds are 95 % of
    the joints' range and the minimum height of elbow and wrist, with a margin. Where the flag is false, the pose is the
    nearest that was found; with `q0` it may then differ from NumPy's.
    """
    point = points("target", target, model.EE_DESIRED_HEIGHT_M)
    start = None
    if q0 is not None:
        point, start = broadcast("target and q0", point, joints("q0", q0))
        start = _contiguous(start)
    q = np.empty((*point.shape[:-1], model.JOINTS))
    is_solved = np.empty(point.shape[:-1], np.bool_)
    _native.arm_inverse(_contiguous(point), start, q, is_solved)
    # Indexing with () turns the flag of a single point into np.bool_.
    return q, is_solved[()]


def posture_velocities(target: ArrayLike, velocity: ArrayLike) -> Floats:
    """Joint velocities (..., 7), rad/s, that keep the pose `inverse(target)` on moving points.

    `target` as for `inverse`; `velocity` is (..., 2), at constant height, or (..., 3), m/s.
    """
    point, speed = broadcast(
        "target and velocity",
        points("target", target, model.EE_DESIRED_HEIGHT_M),
        points("velocity", velocity, 0.0),
    )
    dq = np.empty((*point.shape[:-1], model.JOINTS))
    _native.arm_posture_velocities(_contiguous(point), _contiguous(speed), dq)
    return dq


def velocities(q: ArrayLike, velocity: ArrayLike) -> Floats:
    """Joint velocities (..., 7), rad/s, that move the end effector at `q` (..., 7), rad, with `velocity`, m/s.

    `velocity` is (..., 2), at constant height, or (..., 3). The norm, weighted by the joints' limits, is minimal.
    """
    pose, speed = broadcast("q and velocity", joints("q", q), points("velocity", velocity, 0.0))
    dq = np.empty(pose.shape)
    _native.arm_velocities(_contiguous(pose), _contiguous(speed), dq)
    return dq


def constraints(q: ArrayLike, dq: ArrayLike) -> Constraints:
    """The constraints at joint positions (..., 7), rad, and velocities (..., 7), rad/s.

    The rules apply to the low-pass filtered velocities of the observation.
    """
    pose, rates = broadcast("q and dq", joints("q", q), joints("dq", dq))
    values = np.empty((*pose.shape[:-1], 35))
    _native.arm_constraints(_contiguous(pose), _contiguous(rates), values)
    return Constraints(
        ee=values[..., :5],
        link=values[..., 5:7],
        joint_pos=values[..., 7:21],
        joint_vel=values[..., 21:],
    )


def _contiguous(array: Floats) -> Floats:
    """The array in C order and aligned, as the compiled half requires it."""
    return np.require(array, requirements=("C", "A"))
