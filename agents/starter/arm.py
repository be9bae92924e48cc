"""The arm as a crane: where the mallet shall be -> joint angles, within the speed limits.

Joints 3, 5 and 7 stay at zero. Joint 1 then turns the whole arm towards a point, and joints 2, 4 and 6
move it in a vertical plane: upper arm, forearm and hand, three sticks. How the hand leans is a free
choice; with that made, school geometry does the rest. (Striker, in Rust, uses all seven joints.)
"""

import math

SHOULDER = 0.36  # height of joint 2, metres
UPPER_ARM = 0.42
FOREARM = 0.40
HAND = 0.666  # from joint 6 to the mallet's joint
SPEED_SHARE = 0.8  # of the joint speeds that the rules allow; the rest is for the controller's errors
ACCELERATION = 8.0  # of the mallet, m/s²


def joints_at(x, y, z):
    """The seven angles with which the mallet is at a point of the robot's base frame."""
    reach = math.hypot(x, y)
    # The hand's angle from straight up: hanging down near the base, stretched out far from it.
    hand = 2.618 - 0.85 * (reach - 0.65)
    ahead = reach - HAND * math.sin(hand)
    above = z - HAND * math.cos(hand) - SHOULDER
    # Shoulder, elbow and wrist are a triangle whose sides are known.
    side = max(0.05, min(math.hypot(ahead, above), 0.999 * (UPPER_ARM + FOREARM)))
    elbow = _corner(side, UPPER_ARM, FOREARM)
    upper = math.atan2(ahead, above) - _corner(FOREARM, UPPER_ARM, side)
    forearm = upper + math.pi - elbow
    return [math.atan2(y, x), upper, 0.0, upper - forearm, 0.0, hand - forearm, 0.0]


def mallet_at(q):
    """The inverse of `joints_at`, for any angles of joints 1, 2, 4 and 6: x and y of the mallet."""
    forearm = q[1] - q[3]
    hand = forearm + q[5]
    reach = UPPER_ARM * math.sin(q[1]) + FOREARM * math.sin(forearm) + HAND * math.sin(hand)
    return reach * math.cos(q[0]), reach * math.sin(q[0])


def _corner(opposite, a, b):
    """The angle of a triangle between sides a and b."""
    cosine = (a * a + b * b - opposite * opposite) / (2 * a * b)
    return math.acos(max(-1.0, min(1.0, cosine)))


class Arm:
    """Moves a reference of the mallet smoothly, and says which joint angles and speeds belong to it."""

    def __init__(self, env):
        robot = env["robot"]
        self.dt = env["dt"]
        self.height = robot["ee_desired_height"]
        # The rules count more than 95 % of a limit as broken.
        self.speed_limit = [SPEED_SHARE * 0.95 * limit for limit in robot["joint_vel_limit"][1]]
        table, mallet = env["table"], env["mallet"]["radius"]
        # The robot stands this far from the table's centre. 15 mm are for what the arm does not follow.
        self.base = abs(_base_x(robot["base_frame"][0]))
        self.x_min = self.base - table["length"] / 2 + mallet + 0.015
        self.y_max = table["width"] / 2 - mallet - 0.015
        self.reach_max = 1.30

    def reset(self, q):
        """Start of an episode or rally: at rest, at the joint angles that were seen."""
        self.pos = mallet_at(q)
        self.vel = (0.0, 0.0)

    def inside(self, x, y):
        """The nearest point that the mallet may go to."""
        y = max(-self.y_max, min(self.y_max, y))
        x_max = math.sqrt(self.reach_max**2 - y * y)
        return max(self.x_min, min(x_max, x)), y

    def go(self, target, speed, final=(0.0, 0.0)):
        """One control step towards `target`, at most at `speed` and with velocity `final` there."""
        x, y = self.inside(*target)
        way = (x - self.pos[0], y - self.pos[1])
        distance = math.hypot(*way)
        # As fast as it can still brake, at half of the acceleration.
        wish = min(speed, math.sqrt(ACCELERATION * distance)) / max(distance, 1e-6)
        wish = min(wish, 0.5 / self.dt)
        return self.move(way[0] * wish + final[0], way[1] * wish + final[1])

    def move(self, vx, vy):
        """One control step at a wanted velocity: the action."""
        change = (vx - self.vel[0], vy - self.vel[1])
        share = min(1.0, ACCELERATION * self.dt / max(math.hypot(*change), 1e-9))
        vx, vy = self.vel[0] + share * change[0], self.vel[1] + share * change[1]
        now = joints_at(*self.pos, self.height)
        # Where a joint would be too fast, the mallet goes slower. Twice, for the geometry is not linear.
        for _ in range(2):
            x, y, vx, vy = self._step(vx, vy)
            q = joints_at(x, y, self.height)
            dq = self._speeds(x, y, vx, vy)
            load = max(
                max(abs(b - a) / self.dt, abs(v)) / limit
                for a, b, v, limit in zip(now, q, dq, self.speed_limit)
            )
            if load <= 1.0:
                break
            vx, vy = vx / load, vy / load
        self.pos, self.vel = (x, y), (vx, vy)
        return [q, dq]

    def _step(self, vx, vy):
        """Position after a step that ends with a velocity, and that velocity; both stop at the bounds."""
        x = self.pos[0] + 0.5 * self.dt * (self.vel[0] + vx)
        y = self.pos[1] + 0.5 * self.dt * (self.vel[1] + vy)
        inside_x, inside_y = self.inside(x, y)
        if inside_x != x:
            vx = 0.0
        if inside_y != y:
            vy = 0.0
        return inside_x, inside_y, vx, vy

    def _speeds(self, x, y, vx, vy):
        """Joint speeds that belong to a velocity of the mallet, as a difference quotient."""
        tiny = 1e-4
        before = joints_at(x - tiny * vx, y - tiny * vy, self.height)
        after = joints_at(x + tiny * vx, y + tiny * vy, self.height)
        return [(b - a) / (2 * tiny) for a, b in zip(before, after)]


def _base_x(frame):
    """The x of a 4×4 transform, given as four rows or as sixteen numbers."""
    return frame[3] if len(frame) == 16 else frame[0][3]
