"""Trajectories of the mallet, as actions for every interpolation of the protocol.

A trajectory is a minimum-jerk polynomial of the mallet's position over time. The joints follow it with the postures
that `inverse` gives for each position. Its knots, one per control step, are exact. Between them the controller
interpolates; the deviation is what a polynomial of its order cannot follow within 20 ms.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from . import model
from .arrays import Floats, finite, joints, points
from .limits import constraints, speed_share_unchecked
from .poses import is_solution, posture, posture_rates

INTERPOLATIONS = (1, 2, 3, 4, 5, -1, None)
"""The interpolation codes of the protocol."""

# Control steps of an episode, the longest trajectory.
_STEPS_MAX = 500
# Below this distance, rad, the quadratic interpolation starts at rest.
_QUADRATIC_REST_RAD = 1e-3
# Half of the interval of the difference quotient for accelerations, s.
_INSTANT_S = 1e-5


@dataclass(frozen=True)
class Trajectory:
    """Knots at the end of each of n control steps, and the 20 set-points of each step."""

    q: Floats
    """(n, 7): joint positions, rad."""
    dq: Floats
    """(n, 7): joint velocities, rad/s."""
    ddq: Floats
    """(n, 7): joint accelerations, rad/s²."""
    dense: Floats
    """(n, 20, 3, 7): position, velocity and acceleration at each millisecond of each step."""
    speed_share: float
    """The largest joint velocity, as a share of the allowed one."""
    ok: bool
    """Whether all points are within all bounds and no joint exceeds the requested share of its velocity."""

    def __len__(self) -> int:
        return len(self.q)

    @property
    def duration_s(self) -> float:
        """Duration, s."""
        return len(self) * model.CONTROL_STEP_S

    def actions(self, interpolation: int | None) -> Floats:
        """The actions of the n steps: (n, 7), (n, 2, 7), (n, 3, 7) or (n, 20, 3, 7), as in the protocol."""
        if interpolation in (1, 2):
            return self.q
        if interpolation in (3, 4, -1):
            return np.stack([self.q, self.dq], axis=1)
        if interpolation == 5:
            return np.stack([self.q, self.dq, self.ddq], axis=1)
        if interpolation is None:
            return self.dense
        raise _unknown_interpolation(interpolation)


def minimum_jerk(
    start: ArrayLike,
    end: ArrayLike,
    *,
    duration_s: float | None = None,
    start_velocity: ArrayLike = (0.0, 0.0),
    end_velocity: ArrayLike = (0.0, 0.0),
    share: float = 0.9,
) -> Trajectory:
    """A minimum-jerk trajectory of the mallet from one point to another, at the mallet's height or in space.

    `start` and `end` are (2,) or (3,), m, velocities there (2,) or (3,), m/s; accelerations are 0 at both ends. The
    joints begin and end in the postures of `inverse(start)` and `inverse(end)`. `duration_s` (s) is rounded to whole
    control steps of 20 ms; `ok` then says whether joint velocities stay below `share` of the allowed ones. Without it
    the trajectory is as short as `share` permits. A share below 1 leaves room for the controller's overshoot.
    """
    ends = [
        _single_point(name, value, z)
        for name, value, z in (
            ("start", start, model.EE_DESIRED_HEIGHT_M),
            ("end", end, model.EE_DESIRED_HEIGHT_M),
            ("start_velocity", start_velocity, 0.0),
            ("end_velocity", end_velocity, 0.0),
        )
    ]
    if not 0.0 < share <= 1.0:
        raise ValueError(f"share: expected more than 0 and at most 1, got {share}")
    if duration_s is None:
        return _trajectory(ends, _shortest(ends, share), share)
    longest = _STEPS_MAX * model.CONTROL_STEP_S
    if not 0.0 < duration_s <= longest:
        raise ValueError(f"duration_s: expected more than 0 and at most {longest}, got {duration_s}")
    return _trajectory(ends, max(1, round(duration_s / model.CONTROL_STEP_S)), share)


def setpoints(
    q: ArrayLike, actions: ArrayLike, interpolation: int | None, dq: ArrayLike | None = None
) -> Floats:
    """The controller's set-points for n actions, before its limiter: (n, 20, 3, 7), one per millisecond.

    `q` (7,), rad, is the last commanded position, `dq` (7,), rad/s, its velocity (default 0); its acceleration is 0.
    `actions` are n actions as in the protocol.
    """
    if interpolation not in INTERPOLATIONS:
        raise _unknown_interpolation(interpolation)
    shape = {1: (7,), 2: (7,), 5: (3, 7), None: (20, 3, 7)}.get(interpolation, (2, 7))
    checked = finite("actions", actions)
    if checked.shape[1:] != shape or checked.ndim == 0:
        raise ValueError(f"actions: expected shape (n, {', '.join(map(str, shape))}), got {checked.shape}")
    state = np.zeros((3, model.JOINTS))
    for row, name, value in ((0, "q", q), (1, "dq", np.zeros(model.JOINTS) if dq is None else dq)):
        values = joints(name, value)
        if values.ndim != 1:
            raise ValueError(f"{name}: expected shape ({model.JOINTS},), got {values.shape}")
        state[row] = values
    steps = np.empty((len(checked), model.SUBSTEPS, 3, model.JOINTS))
    for k, action in enumerate(checked):
        steps[k] = _interpolate(interpolation, state, action)
        state = steps[k, -1]
    return steps


def _interpolate(interpolation: int | None, state: Floats, action: Floats) -> Floats:
    """One control step, (20, 3, 7), from position, velocity and acceleration (3, 7)."""
    if interpolation is None:
        return action
    duration = model.CONTROL_STEP_S
    t: Floats = model.SUBSTEP_S * np.arange(1.0, model.SUBSTEPS + 1.0)[:, None]
    p, v, a = state
    if interpolation == -1:
        s = t / duration
        rate = np.broadcast_to((action[1] - v) / duration, (model.SUBSTEPS, model.JOINTS))
        return np.stack([p + (action[0] - p) * s, v + (action[1] - v) * s, rate], axis=1)
    c: list[Floats] = [p, np.zeros_like(p), np.zeros_like(p), np.zeros_like(p)]
    c += [np.zeros_like(p), np.zeros_like(p)]
    if interpolation == 1:
        c[1] = (action - p) / duration
    elif interpolation == 2:
        c[1] = v if np.linalg.norm(action - p) >= _QUADRATIC_REST_RAD else np.zeros_like(p)
        c[2] = (action - p - c[1] * duration) / duration**2
    else:
        a = np.zeros_like(p) if interpolation == 3 else a
        c[1], c[2] = v, 0.5 * a
        dp = action[0] - p - v * duration - c[2] * duration**2
        dv = (action[1] - v - a * duration) * duration
        if interpolation == 3:
            c[2], c[3] = (3.0 * dp - dv) / duration**2, (dv - 2.0 * dp) / duration**3
        elif interpolation == 4:
            c[3], c[4] = (4.0 * dp - dv) / duration**3, (dv - 3.0 * dp) / duration**4
        else:
            da = (action[2] - a) * duration**2
            c[3] = (10.0 * dp - 4.0 * dv + 0.5 * da) / duration**3
            c[4] = (-15.0 * dp + 7.0 * dv - da) / duration**4
            c[5] = (6.0 * dp - 3.0 * dv + 0.5 * da) / duration**5
    position = sum(ck * t**k for k, ck in enumerate(c))
    velocity = sum(k * ck * t ** (k - 1) for k, ck in enumerate(c) if k >= 1)
    acceleration = sum(k * (k - 1) * ck * t ** (k - 2) for k, ck in enumerate(c) if k >= 2)
    return np.stack([position, velocity, acceleration], axis=1)


def _shortest(ends: list[Floats], share: float) -> int:
    """The smallest count of control steps with allowed speeds, by doubling and bisection."""

    def is_allowed(steps: int) -> bool:
        position, speed = _path(ends, steps, _times(steps))
        return bool(speed_share_unchecked(posture_rates(position, speed)).max() <= share)

    high = 1
    while high < _STEPS_MAX and not is_allowed(high):
        high = min(2 * high, _STEPS_MAX)
    low = high // 2
    while high - low > 1:
        middle = (high + low) // 2
        if is_allowed(middle):
            high = middle
        else:
            low = middle
    return high


def _times(steps: int) -> Floats:
    """Times of each millisecond of `steps` control steps, the last included, s."""
    return model.SUBSTEP_S * np.arange(1.0, steps * model.SUBSTEPS + 1.0)


def _path(ends: list[Floats], steps: int, t: Floats) -> tuple[Floats, Floats]:
    """The mallet at times (m,), s: positions and velocities (m, 3).

    `ends` are the start, the end, and the velocities there, (3,) each.
    """
    start, end, v0, v1 = ends
    duration = steps * model.CONTROL_STEP_S
    s = (t / duration)[:, None]
    offset = end - start - v0 * duration
    change = (v1 - v0) * duration
    cubic, quartic, quintic = (
        10.0 * offset - 4.0 * change,
        -15.0 * offset + 7.0 * change,
        6.0 * offset - 3.0 * change,
    )
    position = start + v0 * duration * s + s**3 * (cubic + s * (quartic + s * quintic))
    rate = 3.0 * cubic + s * (4.0 * quartic + s * 5.0 * quintic)
    return position, v0 + s**2 * rate / duration


def _trajectory(ends: list[Floats], steps: int, share: float) -> Trajectory:
    t = _times(steps)
    position, speed = _path(ends, steps, t)
    q = posture(position)
    dq = posture_rates(position, speed)
    before, after = (
        posture_rates(*_path(ends, steps, t + instant)) for instant in (-_INSTANT_S, _INSTANT_S)
    )
    ddq = (after - before) / (2.0 * _INSTANT_S)
    dense = np.stack([q, dq, ddq], axis=1).reshape(steps, model.SUBSTEPS, 3, model.JOINTS)
    fastest = float(speed_share_unchecked(dq).max())
    worst = constraints(q, np.zeros_like(q)).worst()
    inside = all(bool((values <= 0.0).all()) for values in worst.values())
    knots = dense[:, -1]
    return Trajectory(
        q=knots[:, 0],
        dq=knots[:, 1],
        ddq=knots[:, 2],
        dense=dense,
        speed_share=fastest,
        ok=bool(is_solution(q, position).all()) and inside and fastest <= share,
    )


def _single_point(name: str, value: ArrayLike, z: float) -> Floats:
    array = points(name, value, z)
    if array.shape != (3,):
        raise ValueError(f"{name}: expected shape (2,) or (3,), got {np.shape(value)}")
    return array


def _unknown_interpolation(interpolation: object) -> ValueError:
    known = ", ".join(map(str, INTERPOLATIONS))
    return ValueError(f"interpolation: expected one of {known}, got {interpolation}")
