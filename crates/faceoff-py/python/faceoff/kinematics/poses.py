"""Forward and inverse kinematics and velocities, for batches.

The algorithms are those of `faceoff.kinematics.plain`, which explains them, applied to arrays.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import model, plain
from .arrays import Floats, broadcast, joints, points

_OFFSETS = np.array(model.LINK_OFFSET_M)
_MOUNTS = np.array(model.LINK_MOUNT)
# Bounds of commanded joint positions, ± rad.
_BOUND = np.array(plain.JOINT_BOUND_RAD)
# Weight of each joint in least squares: a fast joint moves more.
_WEIGHT = np.array(model.VELOCITY_LIMIT_RAD_S) ** 2
# Angle of the hand (from joint 6 to the end effector) from straight up in the start pose, rad.
_HAND_START = plain.START_HAND_RAD
# Lengths of the arm's three parts in its vertical plane, m.
_UPPER, _FOREARM, _HAND = plain.UPPER_ARM_M, plain.FOREARM_M, plain.HAND_M
# Minimum height of elbow and wrist, m.
_MIN_HEIGHT = model.LINK_HEIGHT_M + plain.HEIGHT_MARGIN_M


def forward(q: ArrayLike) -> Floats:
    """The end effector at joint positions `q` (..., 7), rad: (..., 3), m, base frame."""
    origins, _ = _chain(joints("q", q))
    return origins[..., model.JOINTS, :]


def jacobian(q: ArrayLike) -> Floats:
    """How the end effector's x, y, z change with each joint at `q` (..., 7), rad: (..., 3, 7), m/rad."""
    return _jacobian(*_chain(joints("q", q)))


def heights(q: ArrayLike) -> Floats:
    """Heights of elbow and wrist (the origins of links 4 and 7) at `q` (..., 7), rad: (..., 2), m."""
    origins, _ = _chain(joints("q", q))
    return origins[..., [3, 6], 2]


def frames(q: ArrayLike) -> tuple[Floats, Floats]:
    """Origins (..., 8, 3), m, and rotations (..., 8, 3, 3) of links 1…7 and the end effector at `q` (..., 7), rad.

    The columns of a rotation are the frame's axes in the base frame; joint i turns about the third one.
    """
    origins, rotations = _frames(joints("q", q))
    return origins, np.concatenate([rotations, rotations[..., -1:, :, :]], axis=-3)


def inverse(target: ArrayLike, q0: ArrayLike | None = None) -> tuple[Floats, NDArray[np.bool_]]:
    """Joint positions (..., 7), rad, that put the end effector at points, and (...) whether they do within bounds.

    `target` is (..., 2), at the mallet's height, or (..., 3); m, base frame. Without `q0` the result is the point's
    posture, in closed form; with `q0` (..., 7), rad, it is a pose near it, by damped least squares. Bounds are 95 % of
    the joints' range and the minimum height of elbow and wrist, with a margin. Where the flag is false, the pose is the
    nearest that was found. `faceoff.kinematics.plain` describes the algorithm.
    """
    point = points("target", target, model.EE_DESIRED_HEIGHT_M)
    if q0 is None:
        q = posture(point)
    else:
        point, start = broadcast("target and q0", point, joints("q0", q0))
        leading = point.shape[:-1]
        q = _least_squares(point.reshape(-1, 3), start.reshape(-1, model.JOINTS))
        q = q.reshape(*leading, model.JOINTS)
    return q, is_solution(q, point)


def posture_velocities(target: ArrayLike, velocity: ArrayLike) -> Floats:
    """Joint velocities (..., 7), rad/s, that keep the pose `inverse(target)` on moving points.

    `target` as for `inverse`; `velocity` is (..., 2), at constant height, or (..., 3), m/s.
    """
    point, speed = broadcast(
        "target and velocity",
        points("target", target, model.EE_DESIRED_HEIGHT_M),
        points("velocity", velocity, 0.0),
    )
    return posture_rates(point, speed)


def posture_rates(point: Floats, speed: Floats) -> Floats:
    """`posture_velocities` without checks, for points and velocities (..., 3) of any magnitude."""
    x, y = point[..., 0], point[..., 1]
    vx, vy, vz = speed[..., 0], speed[..., 1], speed[..., 2]
    reach = np.maximum(np.hypot(x, y), 1e-6)
    outwards = (x * vx + y * vy) / reach
    q = posture(point)
    upper = q[..., 1]
    forearm = upper - q[..., 3]
    hand = forearm + q[..., 5]
    hand_rate = -plain.HAND_PER_REACH_RAD_M * outwards
    ahead_rate = outwards - _HAND * np.cos(hand) * hand_rate
    above_rate = vz + _HAND * np.sin(hand) * hand_rate
    span = np.sin(upper - forearm)
    span = np.copysign(np.maximum(np.abs(span), 1e-6), span)
    upper_rate = -(np.sin(forearm) * ahead_rate + np.cos(forearm) * above_rate) / (_UPPER * span)
    forearm_rate = (np.cos(upper) * above_rate + np.sin(upper) * ahead_rate) / (_FOREARM * span)
    rates = np.zeros_like(q)
    rates[..., 0] = (x * vy - y * vx) / (reach * reach)
    rates[..., 1] = upper_rate
    rates[..., 3] = upper_rate - forearm_rate
    rates[..., 5] = hand_rate - forearm_rate
    return rates


def velocities(q: ArrayLike, velocity: ArrayLike) -> Floats:
    """Joint velocities (..., 7), rad/s, that move the end effector at `q` (..., 7), rad, with `velocity`, m/s.

    `velocity` is (..., 2), at constant height, or (..., 3). The norm, weighted by the joints' limits, is minimal.
    """
    pose, speed = broadcast("q and velocity", joints("q", q), points("velocity", velocity, 0.0))
    return _least_change(_jacobian(*_chain(pose)), speed, np.broadcast_to(_WEIGHT, pose.shape))


def _frames(q: Floats) -> tuple[Floats, Floats]:
    """Origins of links 1…7 and of the end effector, rotations of links 1…7."""
    leading = q.shape[:-1]
    origins = np.empty((*leading, model.JOINTS + 1, 3))
    rotations = np.empty((*leading, model.JOINTS, 3, 3))
    origin = np.zeros((*leading, 3))
    rotation = np.broadcast_to(np.eye(3), (*leading, 3, 3))
    for joint in range(model.JOINTS):
        origin = origin + rotation @ _OFFSETS[joint]
        mounted = rotation @ _MOUNTS[joint]
        sine, cosine = np.sin(q[..., joint, None]), np.cos(q[..., joint, None])
        x, y = mounted[..., 0], mounted[..., 1]
        rotation = np.stack([x * cosine + y * sine, y * cosine - x * sine, mounted[..., 2]], axis=-1)
        origins[..., joint, :] = origin
        rotations[..., joint, :, :] = rotation
    origins[..., model.JOINTS, :] = origin + rotation[..., 2] * model.END_EFFECTOR_Z_M
    return origins, rotations


def _chain(q: Floats) -> tuple[Floats, Floats]:
    """Origins (..., 8, 3) as in `_frames`, and the joints' axes (..., 7, 3)."""
    origins, rotations = _frames(q)
    axes: Floats = rotations[..., 2]
    return origins, axes


def _jacobian(origins: Floats, axes: Floats) -> Floats:
    arms = origins[..., -1:, :] - origins[..., :-1, :]
    rows: Floats = np.swapaxes(np.cross(axes, arms), -1, -2)
    return rows


def posture(point: Floats) -> Floats:
    """`inverse` without a start pose: points (..., 3) to joint positions (..., 7)."""
    x, y, z = point[..., 0], point[..., 1], point[..., 2]
    reach = np.hypot(x, y)
    hand = _HAND_START - plain.HAND_PER_REACH_RAD_M * (reach - _START_REACH)
    ahead = reach - _HAND * np.sin(hand)
    above = z - _HAND * np.cos(hand) - plain.SHOULDER_M
    side = np.hypot(ahead, above)
    elbow = _triangle_angle(side, _UPPER, _FOREARM)
    upper = np.arctan2(ahead, above) - _triangle_angle(_FOREARM, _UPPER, np.maximum(side, 1e-9))
    forearm = upper + np.pi - elbow
    q = np.zeros((*reach.shape, model.JOINTS))
    q[..., 0] = np.arctan2(y, x)
    q[..., 1] = upper
    q[..., 3] = upper - forearm
    q[..., 5] = hand - forearm
    return q


def _triangle_angle(opposite: Floats | float, a: float, b: Floats | float) -> Floats:
    cosine = (a * a + b * b - opposite * opposite) / (2.0 * a * b)
    angle: Floats = np.arccos(np.clip(cosine, -1.0, 1.0))
    return angle


def _least_squares(point: Floats, q0: Floats) -> Floats:
    """Poses (n, 7) for points (n, 3) from start poses (n, 7); only unfinished rows are iterated."""
    q = np.clip(q0, -_BOUND, _BOUND)
    active = np.arange(len(q))
    for _ in range(plain.ITERATIONS):
        pose = q[active]
        origins, axes = _chain(pose)
        error = point[active] - origins[:, -1]
        deficit = _MIN_HEIGHT - origins[:, 6, 2]
        unfinished = (np.sqrt(np.sum(error * error, axis=-1)) >= plain.CONVERGENCE_TOLERANCE_M) | (deficit > 0.0)
        if not unfinished.any():
            break
        active, pose = active[unfinished], pose[unfinished]
        origins, axes = origins[unfinished], axes[unfinished]
        error, deficit = error[unfinished], deficit[unfinished]
        rows = _jacobian(origins, axes)
        rise = np.cross(axes, origins[:, 6:7] - origins[:, :7])[..., 2]
        step = _step(rows, rise, error, deficit, np.broadcast_to(_WEIGHT, pose.shape))
        # Joints at their bound that the step would push further are excluded, and the step is computed once more.
        stuck = (np.abs(pose + step) > _BOUND) & (np.abs(pose) >= _BOUND) & (pose * step > 0.0)
        usable = np.where(stuck, 0.0, _WEIGHT)
        has_stuck = stuck.any(axis=-1)
        if has_stuck.any():
            step[has_stuck] = _step(
                rows[has_stuck], rise[has_stuck], error[has_stuck], deficit[has_stuck], usable[has_stuck]
            )
        length = np.sqrt(np.sum(step * step, axis=-1, keepdims=True))
        share = np.minimum(1.0, plain.STEP_LIMIT_RAD / np.maximum(length, 1e-300))
        q[active] = np.clip(pose + share * step, -_BOUND, _BOUND)
    return q


def _step(rows: Floats, rise: Floats, error: Floats, deficit: Floats, weight: Floats) -> Floats:
    """One step of n poses, (n, 7), as in `plain`, which explains the arguments."""
    step = _least_change(rows, error, weight)
    desired = weight * rise
    moved = np.einsum("nij,nj->ni", rows, desired)
    free = desired - _least_change(rows, moved, weight)
    gain = np.sum(rise * free, axis=-1)
    share = np.maximum(deficit, 0.0) / np.maximum(gain, 1e-3)
    raised: Floats = step + share[:, None] * free
    return raised


def _least_change(rows: Floats, desired: Floats, weight: Floats) -> Floats:
    """W Jᵀ (J W Jᵀ + λ I)⁻¹ d, with d `desired`: (..., 3) to joint changes (..., 7)."""
    scaled = rows * weight[..., None, :]
    square = scaled @ np.swapaxes(rows, -1, -2) + plain.DAMPING * np.eye(3)
    a, b, c = square[..., 0, :], square[..., 1, :], square[..., 2, :]
    bc, ca, ab = np.cross(b, c), np.cross(c, a), np.cross(a, b)
    determinant = np.sum(a * bc, axis=-1, keepdims=True)
    columns = np.stack([bc, ca, ab], axis=-1)
    force = np.einsum("...ij,...j->...i", columns, desired) / determinant
    change: Floats = np.einsum("...ij,...i->...j", scaled, force)
    return change


def is_solution(q: Floats, point: Floats) -> NDArray[np.bool_]:
    """Whether poses (..., 7) put the end effector at points (..., 3) within all bounds: (...)."""
    origins, _ = _chain(q)
    error = point - origins[..., -1, :]
    near = np.sum(error * error, axis=-1) <= plain.SOLUTION_TOLERANCE_M**2
    high = np.min(origins[..., [3, 6], 2], axis=-1) >= _MIN_HEIGHT - 1e-9
    solved: NDArray[np.bool_] = near & high & np.all(np.abs(q) <= _BOUND, axis=-1)
    return solved


_START_REACH = float(np.hypot(*forward(model.START_Q)[:2]))
