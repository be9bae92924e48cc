"""Converts mallet motions to joint angles within the speed limits, with the arm as a chain of three links in
a vertical plane.

Joints 3, 5 and 7 stay at zero. Joint 1 turns the whole arm towards a point, and joints 2, 4 and 6 move it
in a vertical plane: upper arm, forearm and hand. The hand's angle is a fixed function of the reach; the rest
follows from triangles. (Striker, in Rust, uses all seven joints.)
"""

import math

# Lengths in metres.
SHOULDER = 0.36  # height of joint 2
UPPER_ARM = 0.42  # from joint 2 to joint 4
FOREARM = 0.40  # from joint 4 to joint 6
HAND = 0.666  # from joint 6 to the mallet's joint
SPEED_SHARE = 0.8  # used share of the allowed joint speeds; the rest is for the controller's errors
ACCELERATION = 8.0  # largest acceleration of the mallet, m/s²
MARGIN = 0.015  # distance of the commanded mallet from the bounds of its area, for tracking errors, metres


def joints_at(x, y, z):
    """The seven joint angles, rad, that put the mallet at a point of the robot's base frame, metres."""
    reach = math.hypot(x, y)
    # The hand's angle from straight up: hanging down near the base, stretched out far from it.
    hand = 2.618 - 0.85 * (reach - 0.65)
    ahead = reach - HAND * math.sin(hand)
    above = z - HAND * math.cos(hand) - SHOULDER
    # Shoulder, elbow and wrist form a triangle with known sides.
    side = max(0.05, min(math.hypot(ahead, above), 0.999 * (UPPER_ARM + FOREARM)))
    elbow = _triangle_angle(side, UPPER_ARM, FOREARM)
    upper = math.atan2(ahead, above) - _triangle_angle(FOREARM, UPPER_ARM, side)
    forearm = upper + math.pi - elbow
    return [math.atan2(y, x), upper, 0.0, upper - forearm, 0.0, hand - forearm, 0.0]


def mallet_at(q):
    """x and y of the mallet, metres, for any angles of joints 1, 2, 4 and 6: the inverse of `joints_at`."""
    forearm = q[1] - q[3]
    hand = forearm + q[5]
    reach = UPPER_ARM * math.sin(q[1]) + FOREARM * math.sin(forearm) + HAND * math.sin(hand)
    return reach * math.cos(q[0]), reach * math.sin(q[0])


def _triangle_angle(opposite, a, b):
    """The angle between the sides a and b of a triangle, rad."""
    cosine = (a * a + b * b - opposite * opposite) / (2 * a * b)
    return math.acos(max(-1.0, min(1.0, cosine)))


class Arm:
    """The reference: a smooth commanded motion of the mallet, and its joint angles and speeds."""

    def __init__(self, env):
        robot = env["robot"]
        self.dt = env["dt"]
        self.height = robot["ee_desired_height"]
        # The rules count more than 95 % of a limit as a violation.
        self.speed_limit = [SPEED_SHARE * 0.95 * limit for limit in robot["joint_vel_limit"][1]]
        table, mallet = env["table"], env["mallet"]["radius"]
        # Distance of the robot from the table's centre, metres.
        self.base_distance = abs(_frame_x(robot["base_frame"][0]))
        self.x_min = self.base_distance - table["length"] / 2 + mallet + MARGIN
        self.y_max = table["width"] / 2 - mallet - MARGIN
        self.reach_max = 1.30  # the arm is nearly stretched there, metres

    def reset(self, q):
        """Starts an episode or rally at rest, at the observed joint angles."""
        self.pos = mallet_at(q)
        self.vel = (0.0, 0.0)

    def nearest_allowed(self, x, y):
        """The nearest point in the allowed area of the mallet."""
        y = max(-self.y_max, min(self.y_max, y))
        x_max = math.sqrt(self.reach_max**2 - y * y)
        return max(self.x_min, min(x_max, x)), y

    def move_to(self, target, speed, final_velocity=(0.0, 0.0)):
        """One control step towards `target` at `speed` (m/s) or less, with `final_velocity` there; returns the action."""
        x, y = self.nearest_allowed(*target)
        offset = (x - self.pos[0], y - self.pos[1])
        distance = math.hypot(*offset)
        # The largest speed from which it can still brake, with half of the acceleration.
        gain = min(speed, math.sqrt(ACCELERATION * distance)) / max(distance, 1e-6)
        gain = min(gain, 0.5 / self.dt)
        return self.move(offset[0] * gain + final_velocity[0], offset[1] * gain + final_velocity[1])

    def move(self, vx, vy):
        """One control step at a desired velocity, m/s; returns the action."""
        change = (vx - self.vel[0], vy - self.vel[1])
        share = min(1.0, ACCELERATION * self.dt / max(math.hypot(*change), 1e-9))
        vx, vy = self.vel[0] + share * change[0], self.vel[1] + share * change[1]
        present = joints_at(*self.pos, self.height)
        # The mallet slows down where a joint would be too fast. Two rounds, because the geometry is not linear.
        for _ in range(2):
            x, y, vx, vy = self._step(vx, vy)
            q = joints_at(x, y, self.height)
            dq = self._speeds(x, y, vx, vy)
            load = max(
                max(abs(b - a) / self.dt, abs(v)) / limit
                for a, b, v, limit in zip(present, q, dq, self.speed_limit)
            )
            if load <= 1.0:
                break
            vx, vy = vx / load, vy / load
        self.pos, self.vel = (x, y), (vx, vy)
        return [q, dq]

    def _step(self, vx, vy):
        """Position and velocity after a step that ends with (vx, vy), both limited at the bounds."""
        x = self.pos[0] + 0.5 * self.dt * (self.vel[0] + vx)
        y = self.pos[1] + 0.5 * self.dt * (self.vel[1] + vy)
        allowed_x, allowed_y = self.nearest_allowed(x, y)
        if allowed_x != x:
            vx = 0.0
        if allowed_y != y:
            vy = 0.0
        return allowed_x, allowed_y, vx, vy

    def _speeds(self, x, y, vx, vy):
        """Joint speeds, rad/s, for a velocity of the mallet, as a difference quotient."""
        half_interval = 1e-4
        before = joints_at(x - half_interval * vx, y - half_interval * vy, self.height)
        after = joints_at(x + half_interval * vx, y + half_interval * vy, self.height)
        return [(b - a) / (2 * half_interval) for a, b in zip(before, after)]


def _frame_x(frame):
    """The x of a 4×4 transform of four rows or sixteen numbers."""
    return frame[3] if len(frame) == 16 else frame[0][3]
