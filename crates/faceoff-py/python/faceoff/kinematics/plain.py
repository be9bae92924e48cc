"""Kinematics of the arm for one pose at a time, in plain Python: with the standard library alone, without NumPy.

Copy this file into a bundle: it needs no other file. `faceoff.kinematics` does the same for NumPy arrays.

Points are in the robot's own base frame, metres; angles in rad. The mallet's position is that of the end effector,
the universal joint at the rod's tip. All functions take any sequences of numbers and return lists and tuples.

`inverse` has two ways to choose among the many poses that put the mallet at a point:

- Without a start it returns *the* pose of the point, in closed form: joints 3, 5 and 7 at zero, joint 1 turned
  towards the point, joints 2, 4 and 6 in a vertical plane, elbow up. The angle of the hand (the part from joint 6
  to the end effector) is a fixed linear function
  of the reach, chosen so that the start pose of an episode is the pose of its own point. Poses change smoothly with
  their points, so `posture_velocities` can give the joint velocities for a moving point.
- From a start `q0` it moves all seven joints as little as it can: damped least squares, each joint weighted by its
  speed limit, at most `ITERATIONS` steps of at most `STEP_LIMIT_RAD`; a joint at its bound is excluded from a step
  that would push it further, and a low wrist is raised within the arm's null space.
"""

import math
from collections.abc import Sequence

# Constants of the model; a test compares them with `model.py`.
LINK_OFFSET_M = (
    (0.0, 0.0, 0.1575),
    (0.0, 0.0, 0.2025),
    (0.0, 0.2045, 0.0),
    (0.0, 0.0, 0.2155),
    (0.0, 0.1845, 0.0),
    (0.0, 0.0, 0.2155),
    (0.0, 0.081, 0.0),
)
END_EFFECTOR_Z_M = 0.585
POSITION_LIMIT_RAD = (2.96706, 2.0944, 2.96706, 2.0944, 2.96706, 2.0944, 3.05433)
VELOCITY_LIMIT_RAD_S = tuple(limit * (math.pi / 180.0) for limit in (85, 85, 100, 75, 130, 135, 135))
LIMIT_FRACTION = 0.95
START_Q = (0.0, -0.196067345, 0.0, -1.84363898, 0.0, 0.970422238, 0.0)
EE_DESIRED_HEIGHT_M = 0.1645
EE_HEIGHT_TOLERANCE_M = 0.02
LINK_HEIGHT_M = 0.25
BASE_X_M = 1.51
TABLE_LENGTH_M = 1.948
TABLE_WIDTH_M = 1.038
MALLET_RADIUS_M = 0.04815

JOINTS = 7
# Larger magnitudes are refused, as in the protocol.
NUMBER_LIMIT = 1e4
# Margins between commands and the rules' bounds, for the controller's errors.
JOINT_MARGIN_RAD = 0.01
HEIGHT_MARGIN_M = 0.01
# A pose is a solution if its end effector is this close to the point, metres.
SOLUTION_TOLERANCE_M = 1e-6
# The least-squares iteration stops when the end effector is this close to the point, metres.
CONVERGENCE_TOLERANCE_M = 1e-10
# Most iterations.
ITERATIONS = 100
# Longest step of an iteration, in joint space.
STEP_LIMIT_RAD = 0.3
# Added to the diagonal of the normal equations, so that they always have a solution.
DAMPING = 1e-6

# The arm in one plane: height of joint 2, then from joint 2 to 4, from 4 to 6, from 6 to the end effector.
SHOULDER_M = LINK_OFFSET_M[0][2] + LINK_OFFSET_M[1][2]
UPPER_ARM_M = LINK_OFFSET_M[2][1] + LINK_OFFSET_M[3][2]
FOREARM_M = LINK_OFFSET_M[4][1] + LINK_OFFSET_M[5][2]
HAND_M = LINK_OFFSET_M[6][1] + END_EFFECTOR_Z_M
# The hand's angle from straight up in the start pose, and its decrease per metre of additional reach.
START_HAND_RAD = START_Q[1] - START_Q[3] + START_Q[5]
HAND_PER_REACH_RAD_M = 0.85
# Allowed area of the mallet.
X_MIN_M = BASE_X_M - (TABLE_LENGTH_M / 2 - MALLET_RADIUS_M)
Y_MAX_M = TABLE_WIDTH_M / 2 - MALLET_RADIUS_M
# Bounds of commanded joints; the elbow's height depends on joint 2 alone.
_ELBOW_COSINE = (LINK_HEIGHT_M + HEIGHT_MARGIN_M - SHOULDER_M) / UPPER_ARM_M
JOINT_BOUND_RAD = tuple(
    min(
        LIMIT_FRACTION * limit - JOINT_MARGIN_RAD,
        math.acos(_ELBOW_COSINE) if joint == 1 else math.inf,
    )
    for joint, limit in enumerate(POSITION_LIMIT_RAD)
)
# Weight of each joint in least squares, (rad/s)²: a fast joint moves more.
WEIGHT = tuple(limit * limit for limit in VELOCITY_LIMIT_RAD_S)

Vector = tuple[float, float, float]


def forward(q: Sequence[float]) -> Vector:
    """The end effector at seven joint positions (rad): x, y, z in m."""
    origins, _ = _chain(_numbers("q", q, JOINTS))
    return origins[JOINTS]


def jacobian(q: Sequence[float]) -> list[list[float]]:
    """Three rows of seven: how the end effector's x, y, z (m) change with each joint (rad)."""
    origins, axes = _chain(_numbers("q", q, JOINTS))
    return _jacobian(origins, axes)


def heights(q: Sequence[float]) -> tuple[float, float]:
    """Heights of elbow and wrist (the origins of links 4 and 7), m."""
    origins, _ = _chain(_numbers("q", q, JOINTS))
    return origins[3][2], origins[6][2]


def inverse(
    target: Sequence[float], q0: Sequence[float] | None = None
) -> tuple[list[float], bool]:
    """Joint positions (rad) that put the end effector at a point, and whether they do so within all bounds.

    `target` is x, y at the mallet's height, or x, y, z; m. `q0` (rad) is the pose from which the search starts; see
    the module's text. Bounds are 95 % of the joints' range and the minimum height of elbow and wrist, with a margin.
    If the flag is false, the pose is the nearest that was found; do not command it without a check.
    """
    point = _point(target)
    if q0 is None:
        q = _posture(point)
    else:
        q = _least_squares(point, _numbers("q0", q0, JOINTS))
    return q, _is_solution(q, point)


def posture_velocities(target: Sequence[float], velocity: Sequence[float]) -> list[float]:
    """Joint velocities (rad/s) that keep the pose `inverse(target)` on a moving point.

    `target` as for `inverse`; `velocity` of the point: x, y (then z is 0) or x, y, z; m/s.
    """
    x, y, z = _point(target)
    vx, vy, vz = _point(velocity, "velocity", 0.0)
    # On joint 1's axis the outward direction is undefined.
    reach = max(math.hypot(x, y), 1e-6)
    outwards = (x * vx + y * vy) / reach
    _, upper, _, elbow, _, wrist, _ = _posture((x, y, z))
    forearm = upper - elbow
    hand = forearm + wrist
    hand_rate = -HAND_PER_REACH_RAD_M * outwards
    ahead_rate = outwards - HAND_M * math.cos(hand) * hand_rate
    above_rate = vz + HAND_M * math.sin(hand) * hand_rate
    span = math.sin(upper - forearm)
    # A stretched arm cannot move outwards; the result is a large joint velocity.
    span = math.copysign(max(abs(span), 1e-6), span)
    upper_rate = -(math.sin(forearm) * ahead_rate + math.cos(forearm) * above_rate) / (
        UPPER_ARM_M * span
    )
    forearm_rate = (math.cos(upper) * above_rate + math.sin(upper) * ahead_rate) / (FOREARM_M * span)
    around = (x * vy - y * vx) / (reach * reach)
    return [
        around,
        upper_rate,
        0.0,
        upper_rate - forearm_rate,
        0.0,
        hand_rate - forearm_rate,
        0.0,
    ]


def velocities(q: Sequence[float], velocity: Sequence[float]) -> list[float]:
    """Joint velocities (rad/s) that move the end effector of pose `q` (rad) with x, y, z velocity (m/s).

    The norm, weighted by the joints' limits, is minimal. With x and y alone the height is constant.
    """
    origins, axes = _chain(_numbers("q", q, JOINTS))
    return _least_change(_jacobian(origins, axes), _point(velocity, "velocity", 0.0), WEIGHT)


def speed_share(dq: Sequence[float]) -> float:
    """The largest joint velocity (rad/s) as a share of the allowed one: above 1 is a violation."""
    velocity = _numbers("dq", dq, JOINTS)
    return max(abs(v) / (LIMIT_FRACTION * m) for v, m in zip(velocity, VELOCITY_LIMIT_RAD_S))


def constraints(q: Sequence[float], dq: Sequence[float]) -> dict[str, float]:
    """The rules' constraints on the robot at a pose (rad) and joint velocities (rad/s): above 0 is a violation.

    Keys as in the rules: `ee` (m), `link` (m), `joint_pos` (rad), `joint_vel` (rad/s); the largest of each. The
    rules apply to the low-pass filtered velocity.
    """
    q, dq = _numbers("q", q, JOINTS), _numbers("dq", dq, JOINTS)
    origins, _ = _chain(q)
    x, y, z = origins[JOINTS]
    off_height = abs(z - EE_DESIRED_HEIGHT_M) - EE_HEIGHT_TOLERANCE_M
    return {
        "ee": max(X_MIN_M - x, abs(y) - Y_MAX_M, off_height),
        "link": LINK_HEIGHT_M - min(origins[3][2], origins[6][2]),
        "joint_pos": max(abs(a) - LIMIT_FRACTION * m for a, m in zip(q, POSITION_LIMIT_RAD)),
        "joint_vel": max(abs(v) - LIMIT_FRACTION * m for v, m in zip(dq, VELOCITY_LIMIT_RAD_S)),
    }


def _chain(q: Sequence[float]) -> tuple[list[Vector], list[Vector]]:
    """Origins of links 1…7 and of the end effector, and the joints' axes."""
    x, y, z, origin = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
    origins: list[Vector] = []
    axes: list[Vector] = []
    for joint, (angle, (_, along_y, along_z)) in enumerate(zip(q, LINK_OFFSET_M)):
        origin = _sum(origin, _sum(_scaled(y, along_y), _scaled(z, along_z)))
        # A link's frame in its parent's at angle 0: aligned, half a turn about y + z, a quarter turn about x.
        if joint in (1, 2, 4, 6):
            x, y, z = _scaled(x, -1.0), z, y
        elif joint != 0:
            y, z = z, _scaled(y, -1.0)
        sine, cosine = math.sin(angle), math.cos(angle)
        x, y = (
            _sum(_scaled(x, cosine), _scaled(y, sine)),
            _sum(_scaled(y, cosine), _scaled(x, -sine)),
        )
        origins.append(origin)
        axes.append(z)
    origins.append(_sum(origin, _scaled(z, END_EFFECTOR_Z_M)))
    return origins, axes


def _jacobian(origins: Sequence[Vector], axes: Sequence[Vector]) -> list[list[float]]:
    tip = origins[JOINTS]
    columns = [_cross(axis, _sum(tip, _scaled(origin, -1.0))) for axis, origin in zip(axes, origins)]
    return [[column[row] for column in columns] for row in range(3)]


def _posture(point: Vector) -> list[float]:
    x, y, z = point
    reach = math.hypot(x, y)
    hand = START_HAND_RAD - HAND_PER_REACH_RAD_M * (reach - _START_REACH_M)
    ahead = reach - HAND_M * math.sin(hand)
    above = z - HAND_M * math.cos(hand) - SHOULDER_M
    # Shoulder, elbow and wrist are a triangle of known sides; the angles at elbow and shoulder follow.
    side = math.hypot(ahead, above)
    elbow = _triangle_angle(side, UPPER_ARM_M, FOREARM_M)
    upper = math.atan2(ahead, above) - _triangle_angle(FOREARM_M, UPPER_ARM_M, max(side, 1e-9))
    forearm = upper + math.pi - elbow
    return [math.atan2(y, x), upper, 0.0, upper - forearm, 0.0, hand - forearm, 0.0]


def _triangle_angle(opposite: float, a: float, b: float) -> float:
    """The angle between the sides a and b of a triangle; 0 or pi if there is no such triangle."""
    cosine = (a * a + b * b - opposite * opposite) / (2.0 * a * b)
    return math.acos(max(-1.0, min(1.0, cosine)))


def _least_squares(point: Vector, q0: Sequence[float]) -> list[float]:
    q = [max(-bound, min(bound, a)) for a, bound in zip(q0, JOINT_BOUND_RAD)]
    for _ in range(ITERATIONS):
        origins, axes = _chain(q)
        error = _sum(point, _scaled(origins[JOINTS], -1.0))
        deficit = LINK_HEIGHT_M + HEIGHT_MARGIN_M - origins[6][2]
        if math.sqrt(_dot(error, error)) < CONVERGENCE_TOLERANCE_M and deficit <= 0.0:
            break
        rows = _jacobian(origins, axes)
        # Change of the wrist's height with each joint; joint 7's axis passes through the wrist.
        rise = [
            _cross(axis, _sum(origins[6], _scaled(origin, -1.0)))[2]
            for axis, origin in zip(axes, origins)
        ]
        step = _step(rows, rise, error, deficit, WEIGHT)
        usable = [
            0.0 if abs(a + d) > bound and abs(a) >= bound and a * d > 0.0 else w
            for a, d, bound, w in zip(q, step, JOINT_BOUND_RAD, WEIGHT)
        ]
        if 0.0 in usable:
            step = _step(rows, rise, error, deficit, usable)
        length = math.sqrt(sum(d * d for d in step))
        share = min(1.0, STEP_LIMIT_RAD / max(length, 1e-300))
        q = [max(-b, min(b, a + share * d)) for a, d, b in zip(q, step, JOINT_BOUND_RAD)]
    return q


def _step(
    rows: Sequence[Sequence[float]],
    rise: Sequence[float],
    error: Vector,
    deficit: float,
    weight: Sequence[float],
) -> list[float]:
    """One step towards the target; a low wrist is raised without moving the end effector.

    `rows` are those of the Jacobian, `rise` the change of the wrist's height with each joint (m/rad), `error` the way
    from the end effector to the target (m), `deficit` the height that the wrist lacks (m), `weight` that of each joint.
    """
    step = _least_change(rows, error, weight)
    if deficit <= 0.0:
        return step
    desired = [w * g for w, g in zip(weight, rise)]
    moved = (_inner(rows[0], desired), _inner(rows[1], desired), _inner(rows[2], desired))
    free = [a - b for a, b in zip(desired, _least_change(rows, moved, weight))]
    gain = _inner(rise, free)
    share = deficit / max(gain, 1e-3)
    return [a + share * b for a, b in zip(step, free)]


def _least_change(
    rows: Sequence[Sequence[float]], desired: Vector, weight: Sequence[float]
) -> list[float]:
    """W Jᵀ (J W Jᵀ + λ I)⁻¹ d: the smallest weighted joint change that moves the end effector by `desired`, d."""
    scaled = [[w * a for w, a in zip(weight, row)] for row in rows]
    a, b, c = (
        tuple(_inner(scaled[i], rows[k]) + (DAMPING if i == k else 0.0) for k in range(3))
        for i in range(3)
    )
    # The inverse of a symmetric matrix by its rows' vector products.
    bc, ca, ab = _cross(b, c), _cross(c, a), _cross(a, b)
    determinant = _dot(a, bc)
    force = (
        _dot((bc[0], ca[0], ab[0]), desired) / determinant,
        _dot((bc[1], ca[1], ab[1]), desired) / determinant,
        _dot((bc[2], ca[2], ab[2]), desired) / determinant,
    )
    return [
        scaled[0][i] * force[0] + scaled[1][i] * force[1] + scaled[2][i] * force[2]
        for i in range(JOINTS)
    ]


def _is_solution(q: Sequence[float], point: Vector) -> bool:
    origins, _ = _chain(q)
    error = _sum(point, _scaled(origins[JOINTS], -1.0))
    lowest = min(origins[3][2], origins[6][2])
    return (
        _dot(error, error) <= SOLUTION_TOLERANCE_M * SOLUTION_TOLERANCE_M
        and lowest >= LINK_HEIGHT_M + HEIGHT_MARGIN_M - 1e-9
        and all(abs(a) <= bound for a, bound in zip(q, JOINT_BOUND_RAD))
    )


def _numbers(name: str, values: Sequence[float], *counts: int) -> list[float]:
    try:
        numbers = [float(x) for x in values]
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: expected a sequence of numbers, got {values!r:.80}") from error
    if len(numbers) not in counts:
        expected = " or ".join(map(str, counts))
        raise ValueError(f"{name}: expected {expected} numbers, got {len(numbers)}")
    for x in numbers:
        # This comparison is false for NaN, too.
        if not abs(x) <= NUMBER_LIMIT:
            raise ValueError(f"{name}: expected numbers within ±{NUMBER_LIMIT:g}, got {x}")
    return numbers


def _point(
    values: Sequence[float], name: str = "target", z: float = EE_DESIRED_HEIGHT_M
) -> Vector:
    x, y, *rest = _numbers(name, values, 2, 3)
    return x, y, rest[0] if rest else z


def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _scaled(a: Vector, s: float) -> Vector:
    return a[0] * s, a[1] * s, a[2] * s


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def _inner(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(x * y for x, y in zip(a, b))


_START_REACH_M = math.hypot(*_chain(START_Q)[0][JOINTS][:2])
