"""Motions of the mallet, as actions for every interpolation of the protocol.

A motion is a path of the mallet over time, a polynomial of least jerk, which the postures of `inverse` follow. Its
knots, one per control step, lie on it exactly, so that the controller's interpolation between them does, too, but for
what a polynomial of its order cannot follow within 20 ms.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from faceoff.kinematics import model
from faceoff.kinematics.arrays import Floats, finite, joints, points
from faceoff.kinematics.limits import constraints, share_of
from faceoff.kinematics.poses import is_good, posture, posture_rates

INTERPOLATIONS = (1, 2, 3, 4, 5, -1, None)
"""As the protocol numbers them."""

# No motion is longer than an episode.
_STEPS_MAX = 500
# Below this distance, rad, the quadratic interpolation starts at rest.
_QUADRATIC_REST_RAD = 1e-3
# Half of the time over which an acceleration is measured, s.
_INSTANT_S = 1e-5


@dataclass(frozen=True)
class Trajectory:
    """A motion's knots at the end of each of its n control steps, and the 20 set-points of each step."""

    q: Floats
    """(n, 7), rad."""
    dq: Floats
    """(n, 7), rad/s."""
    ddq: Floats
    """(n, 7), rad/s²."""
    dense: Floats
    """(n, 20, 3, 7): position, velocity and acceleration at each millisecond of each step."""
    speed_share: float
    """The largest joint velocity on the way, as a share of what the rules allow."""
    ok: bool
    """Whether every point was reached within all bounds, no faster than was asked for."""

    def __len__(self) -> int:
        return len(self.q)

    @property
    def duration_s(self) -> float:
        """Seconds."""
        return len(self) * model.CONTROL_STEP_S

    def actions(self, interpolation: int | None) -> Floats:
        """The actions of the n steps: (n, 7), (n, 2, 7), (n, 3, 7) or (n, 20, 3, 7), as the protocol wants them."""
        if interpolation in (1, 2):
            return self.q
        if interpolation in (3, 4, -1):
            return np.stack([self.q, self.dq], axis=1)
        if interpolation == 5:
            return np.stack([self.q, self.dq, self.ddq], axis=1)
        if interpolation is None:
            return self.dense
        raise _unknown(interpolation)


def minimum_jerk(
    start: ArrayLike,
    end: ArrayLike,
    *,
    duration_s: float | None = None,
    start_velocity: ArrayLike = (0.0, 0.0),
    end_velocity: ArrayLike = (0.0, 0.0),
    share: float = 0.9,
) -> Trajectory:
    """The mallet's way from one point to another with the least jerk, at the mallet's height or in space.

    `start` and `end` are (2,) or (3,), m, velocities there (2,) or (3,), m/s; accelerations are 0 at both ends. The
    joints begin and end in the postures of `inverse(start)` and `inverse(end)`. With a duration (s, rounded to whole
    control steps of 20 ms) the motion takes as long, and its `ok` tells whether it stays below `share` of the allowed
    joint velocities; without one it takes as long as it needs for that. What is left to 1 is for the controller, which
    overshoots.
    """
    ends = [
        _one(name, given, z)
        for name, given, z in (
            ("start", start, model.EE_DESIRED_HEIGHT_M),
            ("end", end, model.EE_DESIRED_HEIGHT_M),
            ("start_velocity", start_velocity, 0.0),
            ("end_velocity", end_velocity, 0.0),
        )
    ]
    if not 0.0 < share <= 1.0:
        raise ValueError(f"share: expected more than 0 and at most 1, got {share}")
    if duration_s is None:
        return _motion(ends, _shortest(ends, share), share)
    longest = _STEPS_MAX * model.CONTROL_STEP_S
    if not 0.0 < duration_s <= longest:
        raise ValueError(f"duration_s: expected more than 0 and at most {longest}, got {duration_s}")
    return _motion(ends, max(1, round(duration_s / model.CONTROL_STEP_S)), share)


def setpoints(
    q: ArrayLike, actions: ArrayLike, interpolation: int | None, dq: ArrayLike | None = None
) -> Floats:
    """What the controller makes of n actions, before its limiter: (n, 20, 3, 7), a set-point for each millisecond.

    `q` (7,), rad, is the position commanded before, `dq` (7,), rad/s, the velocity then (0 where left out), the
    acceleration 0. `actions` as in the protocol, n of them.
    """
    if interpolation not in INTERPOLATIONS:
        raise _unknown(interpolation)
    shape = {1: (7,), 2: (7,), 5: (3, 7), None: (20, 3, 7)}.get(interpolation, (2, 7))
    rows = finite("actions", actions)
    if rows.shape[1:] != shape or rows.ndim == 0:
        raise ValueError(f"actions: expected shape (n, {', '.join(map(str, shape))}), got {rows.shape}")
    state = np.zeros((3, model.JOINTS))
    for row, name, given in ((0, "q", q), (1, "dq", np.zeros(model.JOINTS) if dq is None else dq)):
        values = joints(name, given)
        if values.ndim != 1:
            raise ValueError(f"{name}: expected shape ({model.JOINTS},), got {values.shape}")
        state[row] = values
    steps = np.empty((len(rows), model.SUBSTEPS, 3, model.JOINTS))
    for k, action in enumerate(rows):
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
    """Control steps: doubled until the speeds are allowed, then halved into the gap."""

    def is_allowed(steps: int) -> bool:
        at, speed = _path(ends, steps, _times(steps))
        return bool(share_of(posture_rates(at, speed)).max() <= share)

    most = 1
    while most < _STEPS_MAX and not is_allowed(most):
        most = min(2 * most, _STEPS_MAX)
    least = most // 2
    while most - least > 1:
        middle = (most + least) // 2
        if is_allowed(middle):
            most = middle
        else:
            least = middle
    return most


def _times(steps: int) -> Floats:
    """Every millisecond of so many control steps, the last included, s."""
    return model.SUBSTEP_S * np.arange(1.0, steps * model.SUBSTEPS + 1.0)


def _path(ends: list[Floats], steps: int, t: Floats) -> tuple[Floats, Floats]:
    """The mallet at times (m,), s: positions and velocities (m, 3)."""
    start, end, v0, v1 = ends
    duration = steps * model.CONTROL_STEP_S
    s = (t / duration)[:, None]
    way = end - start - v0 * duration
    turn = (v1 - v0) * duration
    cubic, quartic, quintic = (
        10.0 * way - 4.0 * turn,
        -15.0 * way + 7.0 * turn,
        6.0 * way - 3.0 * turn,
    )
    at = start + v0 * duration * s + s**3 * (cubic + s * (quartic + s * quintic))
    rate = 3.0 * cubic + s * (4.0 * quartic + s * 5.0 * quintic)
    return at, v0 + s**2 * rate / duration


def _motion(ends: list[Floats], steps: int, share: float) -> Trajectory:
    t = _times(steps)
    at, speed = _path(ends, steps, t)
    q = posture(at)
    dq = posture_rates(at, speed)
    before, after = (
        posture_rates(*_path(ends, steps, t + instant)) for instant in (-_INSTANT_S, _INSTANT_S)
    )
    ddq = (after - before) / (2.0 * _INSTANT_S)
    dense = np.stack([q, dq, ddq], axis=1).reshape(steps, model.SUBSTEPS, 3, model.JOINTS)
    fastest = float(share_of(dq).max())
    worst = constraints(q, np.zeros_like(q)).worst()
    inside = all(bool((values <= 0.0).all()) for values in worst.values())
    knots = dense[:, -1]
    return Trajectory(
        q=knots[:, 0],
        dq=knots[:, 1],
        ddq=knots[:, 2],
        dense=dense,
        speed_share=fastest,
        ok=bool(is_good(q, at).all()) and inside and fastest <= share,
    )


def _one(name: str, given: ArrayLike, z: float) -> Floats:
    array = points(name, given, z)
    if array.shape != (3,):
        raise ValueError(f"{name}: expected shape (2,) or (3,), got {np.shape(given)}")
    return array


def _unknown(interpolation: object) -> ValueError:
    known = ", ".join(map(str, INTERPOLATIONS))
    return ValueError(f"interpolation: expected one of {known}, got {interpolation}")
