"""`air_hockey_challenge.constraints`: the constraints of the rules as objects; a value above 0 is a violation.

The values are those of `faceoff.kinematics.constraints`; the Jacobians are with respect to joint positions and
velocities.
"""

from __future__ import annotations

from collections.abc import KeysView
from typing import Any

import numpy as np

from faceoff.challenge_2023._arguments import Floats, array, entry
from faceoff.challenge_2023._kinematics import frames, link_jacobian
from faceoff.errors import ArgumentError, ArgumentTypeError
from faceoff.kinematics import constraints, model

_ELBOW, _WRIST, _END_EFFECTOR = 3, 6, 7


class Constraint:
    """One group of constraints. A class of your own overrides `_fun` and `_jacobian`."""

    def __init__(self, env_info: Any, output_dim: int, **kwargs: Any) -> None:
        if isinstance(output_dim, bool) or not isinstance(output_dim, int) or output_dim < 1:
            raise ArgumentError(f"output_dim: expected a whole number from 1, got {output_dim!r:.80}")
        self._env_info = env_info
        self._name: str | None = None
        self.output_dim = output_dim
        joints = entry("env_info", env_info, "robot", "n_joints")
        # Where classes of teams may keep their results, as in 2023.
        self._fun_value: Floats = np.zeros(output_dim)
        self._jac_value: Floats = np.zeros((output_dim, 2 * joints))

    @property
    def name(self) -> str | None:
        """The key of the constraint in a `ConstraintList`."""
        return self._name

    def fun(self, q: Any, dq: Any) -> Floats:
        """The values (output_dim,) at joint positions `q` (7,), rad, and velocities `dq` (7,), rad/s."""
        return self._fun(*_state(q, dq))

    def jacobian(self, q: Any, dq: Any) -> Floats:
        """The derivatives (output_dim, 14): with respect to `q`, then to `dq`."""
        return self._jacobian(*_state(q, dq))

    def _fun(self, q: Floats, dq: Floats) -> Floats:
        raise NotImplementedError(f"{type(self).__name__} has no _fun(self, q, dq)")

    def _jacobian(self, q: Floats, dq: Floats) -> Floats:
        raise NotImplementedError(f"{type(self).__name__} has no _jacobian(self, q, dq)")


class ConstraintList:
    """Constraints by name."""

    def __init__(self) -> None:
        self.constraints: dict[str | None, Constraint] = {}

    def keys(self) -> KeysView[str | None]:
        return self.constraints.keys()

    def get(self, key: str) -> Constraint | None:
        """The constraint of this name, or None."""
        return self.constraints.get(key)

    def add(self, c: Constraint) -> None:
        """Adds a constraint, or replaces the one of its name."""
        if not isinstance(c, Constraint):
            raise ArgumentTypeError(f"c: expected a Constraint, got {c!r:.80}")
        self.constraints[c.name] = c

    def delete(self, name: str) -> None:
        """Removes a constraint."""
        if name not in self.constraints:
            known = ", ".join(map(str, self.constraints)) or "no constraint"
            raise ArgumentError(f"name: expected one of the list's, {known}, got {name!r}")
        del self.constraints[name]

    def fun(self, q: Any, dq: Any) -> dict[str | None, Floats]:
        """The values of each constraint at `q` (7,), rad, and `dq` (7,), rad/s."""
        return {name: constraint.fun(q, dq) for name, constraint in self.constraints.items()}

    def jacobian(self, q: Any, dq: Any) -> dict[str | None, Floats]:
        """The derivatives of each constraint, (output_dim, 14)."""
        return {name: constraint.jacobian(q, dq) for name, constraint in self.constraints.items()}


class JointPositionConstraint(Constraint):
    """(14,), rad: above 95 % of the upper limits, then below 95 % of the lower ones."""

    def __init__(self, env_info: Any, **kwargs: Any) -> None:
        super().__init__(env_info, 2 * model.JOINTS, **kwargs)
        self._name = "joint_pos_constr"
        self.joint_limits: Floats = _limits(env_info, "joint_pos_limit")

    def _fun(self, q: Floats, dq: Floats) -> Floats:
        return constraints(q, dq).joint_pos

    def _jacobian(self, q: Floats, dq: Floats) -> Floats:
        return np.hstack([_UP_AND_DOWN, np.zeros_like(_UP_AND_DOWN)])


class JointVelocityConstraint(Constraint):
    """(14,), rad/s: above 95 % of the upper limits, then below 95 % of the lower ones."""

    def __init__(self, env_info: Any, **kwargs: Any) -> None:
        super().__init__(env_info, 2 * model.JOINTS, **kwargs)
        self._name = "joint_vel_constr"
        self.joint_limits: Floats = _limits(env_info, "joint_vel_limit")

    def _fun(self, q: Floats, dq: Floats) -> Floats:
        return constraints(q, dq).joint_vel

    def _jacobian(self, q: Floats, dq: Floats) -> Floats:
        return np.hstack([np.zeros_like(_UP_AND_DOWN), _UP_AND_DOWN])


class EndEffectorConstraint(Constraint):
    """(5,), m, of the end effector: too near, too far right, too far left, too low, too high."""

    def __init__(self, env_info: Any, **kwargs: Any) -> None:
        super().__init__(env_info, 5, **kwargs)
        self._name = "ee_constr"
        # The limits, m, in the robot's base frame.
        self.x_lb = model.BASE_X_M - (model.TABLE_LENGTH_M / 2 - model.MALLET_RADIUS_M)
        self.y_ub = model.TABLE_WIDTH_M / 2 - model.MALLET_RADIUS_M
        self.y_lb = -self.y_ub
        self.z_lb = model.EE_DESIRED_HEIGHT_M - model.EE_HEIGHT_TOLERANCE_M
        self.z_ub = model.EE_DESIRED_HEIGHT_M + model.EE_HEIGHT_TOLERANCE_M

    def _fun(self, q: Floats, dq: Floats) -> Floats:
        return constraints(q, dq).ee

    def _jacobian(self, q: Floats, dq: Floats) -> Floats:
        x, y, z = link_jacobian(*frames(q), _END_EFFECTOR)[:3]
        return _of_positions(np.stack([-x, -y, y, -z, z]))


class LinkConstraint(Constraint):
    """(2,), m: how far wrist and elbow (the origins of links 7 and 4) are below their minimum height."""

    def __init__(self, env_info: Any, **kwargs: Any) -> None:
        super().__init__(env_info, 2, **kwargs)
        self._name = "link_constr"
        self.z_lb = model.LINK_HEIGHT_M

    def _fun(self, q: Floats, dq: Floats) -> Floats:
        elbow_first: Floats = constraints(q, dq).link
        return elbow_first[::-1].copy()

    def _jacobian(self, q: Floats, dq: Floats) -> Floats:
        origins, rotations = frames(q)
        heights = [link_jacobian(origins, rotations, link)[2] for link in (_WRIST, _ELBOW)]
        return _of_positions(-np.stack(heights))


# Derivatives of 14 values: distances beyond the upper limits grow with a joint's value, those beyond the lower ones fall.
_UP_AND_DOWN = np.vstack([np.eye(model.JOINTS), -np.eye(model.JOINTS)])


def _state(q: Any, dq: Any) -> tuple[Floats, Floats]:
    return array("q", q, (model.JOINTS,)), array("dq", dq, (model.JOINTS,))


def _limits(env_info: Any, key: str) -> Floats:
    """What the rules allow, (2, 7): lower, upper."""
    limits = array(f"env_info['robot']['{key}']", entry("env_info", env_info, "robot", key), (2, model.JOINTS))
    return model.LIMIT_FRACTION * limits


def _of_positions(rows: Floats) -> Floats:
    """Derivatives with respect to positions, (n, 7), completed by zeros for velocities: (n, 14)."""
    return np.hstack([rows, np.zeros_like(rows)])
