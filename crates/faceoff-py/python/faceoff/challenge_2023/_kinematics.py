"""`air_hockey_challenge.utils.kinematics`: the functions of 2023 for one pose, with NumPy instead of MuJoCo.

Points are in the robot's base frame, m; joint positions in rad. The first two arguments are `robot_model` and
`robot_data` of `env_info`. As in 2023, each call leaves its joint positions in the second one, and
`inverse_kinematics` starts from there by default.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from faceoff.challenge_2023._arguments import Floats, array, one_of
from faceoff.challenge_2023._mujoco_model import check_robot, update_positions
from faceoff.errors import ArgumentError
from faceoff.kinematics import model

LINKS = ("1", "2", "3", "4", "5", "6", "7", "ee")
"""Origins of the arm's links; `ee` is the end effector, the rod's tip with the mallet's universal joint."""

# The iteration of 2023, on which agents were tuned: damping, the error (m + rad) at which it has succeeded, its most
# iterations, the longest step (rad), and the ratio of error and step from which it gives up.
_DAMPING = 1e-3
_TOLERANCE = 1e-4
_ITERATIONS = 1000
_STEP_LIMIT_RAD = 0.1
_GIVE_UP_RATIO = 20.0
_BOUND = model.LIMIT_FRACTION * np.array(model.POSITION_LIMIT_RAD)


def _link_frames() -> tuple[Floats, Floats, Floats]:
    """Parts of each link's 4×4 frame in its parent, (7, 4, 4): constant, times cosine, times sine of its joint."""
    constant, cosine, sine = np.zeros((3, model.JOINTS, 4, 4))
    mounts = np.array(model.LINK_MOUNT)
    constant[:, 3, 3] = 1.0
    constant[:, :3, 3] = model.LINK_OFFSET_M
    constant[:, :3, 2] = mounts[:, :, 2]
    cosine[:, :3, :2] = mounts[:, :, :2]
    sine[:, :3, 0], sine[:, :3, 1] = mounts[:, :, 1], -mounts[:, :, 0]
    return constant, cosine, sine


_CONSTANT, _COSINE, _SINE = _link_frames()


def frames(q: Floats) -> tuple[Floats, Floats]:
    """Origins (8, 3), m, and rotations (8, 3, 3) of links 1…7 and the end effector at `q` (7,), rad.

    The same as `faceoff.kinematics.frames`, which is made for many poses and takes ten times as long for one: agents of
    2023 call these functions dozens of times within 20 ms.
    """
    local = _CONSTANT + _COSINE * np.cos(q)[:, None, None] + _SINE * np.sin(q)[:, None, None]
    chain = np.empty((model.JOINTS + 1, 4, 4))
    chain[0] = local[0]
    for joint in range(1, model.JOINTS):
        np.matmul(chain[joint - 1], local[joint], out=chain[joint])
    chain[-1] = chain[-2]
    chain[-1, :3, 3] += chain[-1, :3, 2] * model.END_EFFECTOR_Z_M
    return chain[:, :3, 3], chain[:, :3, :3]


def link_jacobian(origins: Floats, rotations: Floats, link: int) -> Floats:
    """How a link's origin (m, rows 0 to 2) and rotation (rad, rows 3 to 5) change with each joint (rad): (6, 7).

    `origins` and `rotations` are those of `frames`; `link` is an index of them.
    """
    rows = np.zeros((6, model.JOINTS))
    moving = min(link + 1, model.JOINTS)
    axes = rotations[:moving, :, 2]
    lever = origins[link] - origins[:moving]
    rows[0, :moving] = axes[:, 1] * lever[:, 2] - axes[:, 2] * lever[:, 1]
    rows[1, :moving] = axes[:, 2] * lever[:, 0] - axes[:, 0] * lever[:, 2]
    rows[2, :moving] = axes[:, 0] * lever[:, 1] - axes[:, 1] * lever[:, 0]
    rows[3:, :moving] = axes.T
    return rows


def forward_kinematics(mj_model: Any, mj_data: Any, q: Any, link: str = "ee") -> tuple[Floats, Floats]:
    """Position (3,), m, and rotation (3, 3) of a link in the robot's base frame at `q` (7,), rad."""
    check_robot(mj_model, mj_data)
    index, pose = _link(link), _pose("q", q)
    _store(mj_model, mj_data, pose)
    origins, rotations = frames(pose)
    return origins[index].copy(), rotations[index].copy()


def jacobian(mj_model: Any, mj_data: Any, q: Any, link: str = "ee") -> Floats:
    """(6, 7): how a link's position (m) and rotation (rad) change with each joint at `q` (7,), rad."""
    check_robot(mj_model, mj_data)
    index, pose = _link(link), _pose("q", q)
    _store(mj_model, mj_data, pose)
    return link_jacobian(*frames(pose), index)


def inverse_kinematics(
    mj_model: Any,
    mj_data: Any,
    desired_position: Any,
    desired_rotation: Any = None,
    initial_q: Any = None,
    link: str = "ee",
) -> tuple[bool, Floats]:
    """Whether the iteration succeeded, and the joint positions (7,), rad, that it reached.

    Args:
        desired_position: of the link, (3,), m; None if only its rotation matters.
        desired_rotation: of the link, (3, 3); None if only its position matters.
        initial_q: start of the iteration, (7,), rad; None for `mj_data.qpos`.

    Damped least squares within 95 % of the joints' ranges, as in 2023: the result depends on `initial_q`, and may
    have an elbow or wrist that is too low. `faceoff.kinematics.inverse` avoids both.
    """
    check_robot(mj_model, mj_data)
    index = _link(link)
    if desired_position is None and desired_rotation is None:
        raise ArgumentError("desired_position: expected three numbers, or a desired_rotation, got None for both")
    position = None if desired_position is None else array("desired_position", desired_position, (3,))
    rotation = None if desired_rotation is None else array("desired_rotation", desired_rotation, (3, 3))
    q = _pose("initial_q", mj_data.qpos if initial_q is None else initial_q).copy()
    success = False
    for iteration in range(_ITERATIONS + 1):
        origins, rotations = frames(q)
        error = np.zeros(6)
        if position is not None:
            error[:3] = position - origins[index]
        if rotation is not None:
            error[3:] = _rotation_vector(rotation @ rotations[index].T)
        size = float(np.linalg.norm(error[:3]) + np.linalg.norm(error[3:]))
        if size < _TOLERANCE:
            success = True
            break
        if iteration == _ITERATIONS:
            break
        used = slice(0 if position is not None else 3, 6 if rotation is not None else 3)
        rows = link_jacobian(origins, rotations, index)[used]
        step = np.linalg.solve(rows.T @ rows + _DAMPING * np.eye(model.JOINTS), rows.T @ error[used])
        length = float(np.linalg.norm(step))
        if size > _GIVE_UP_RATIO * length:
            break
        q = np.clip(q + step * min(1.0, _STEP_LIMIT_RAD / length), -_BOUND, _BOUND)
    _store(mj_model, mj_data, q)
    return success, q


def link_to_xml_name(mj_model: Any, link: str) -> str:
    """The name that a link has in the MuJoCo model of 2023."""
    index = _link(link)
    return "iiwa_1/striker_joint_link" if index == model.JOINTS else f"iiwa_1/link_{link}"


def _rotation_vector(rotation: Floats) -> Floats:
    """Axis times angle (at most π rad) of a rotation matrix."""
    sine = 0.5 * np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    size = float(np.linalg.norm(sine))
    cosine = 0.5 * (float(np.trace(rotation)) - 1.0)
    if size > 1e-9:
        vector: Floats = sine * (np.arctan2(size, cosine) / size)
        return vector
    if cosine > 0.0:
        return sine
    # Half a turn: the matrix is symmetric, 2 a aᵀ − 1, and any column of a aᵀ has the direction of the axis a.
    outer = 0.5 * (rotation + np.eye(3))
    column: Floats = outer[:, int(np.argmax(np.diag(outer)))]
    half_turn: Floats = column * (np.pi / np.linalg.norm(column))
    return half_turn


def _link(link: str) -> int:
    one_of("link", link, LINKS)
    return LINKS.index(link)


def _pose(name: str, q: Any) -> Floats:
    return array(name, q, (model.JOINTS,))


def _store(mj_model: Any, mj_data: Any, q: Floats) -> None:
    """Leaves the joint positions in the second argument, where the functions of 2023 computed."""
    mj_data.qpos = q.copy()
    update_positions(mj_model, mj_data)
