"""Moves the mallet: turns a desired velocity in the table plane into joint motions within the limits."""

import math
from collections.abc import Sequence
from typing import Any

from kinematics import forward, inverse, posture_velocities, speed_share

ACCELERATION = 8.0  # acceleration of the mallet, m/s²
SPEED_SHARE = 0.85  # used fraction of the allowed joint speeds; the rest is a margin for control errors
REACH = 1.25  # largest distance of the mallet from the robot's base, m
MARGIN = 0.015  # distance to the edge of the mallet's area, m


class Mallet:
    """The commanded mallet. It starts at the arm's pose, and the arm follows it. All in the robot's base frame."""

    def __init__(self, env: dict[str, Any]) -> None:
        robot, table = env["robot"], env["table"]
        self.dt: float = env["dt"]  # length of a control step, s
        self.radius: float = env["mallet"]["radius"]
        self.height: float = robot["ee_desired_height"]  # of the end effector, m
        self.middle: float = abs(robot["base_frame"][0][0][3])  # x of the table's centre
        self.goal: float = self.middle - table["length"] / 2  # x of our goal line
        self.x_min: float = self.goal + self.radius + MARGIN
        self.y_max: float = table["width"] / 2 - self.radius - MARGIN

    def reset(self, q: Sequence[float]) -> None:
        """Starts an episode at rest, at the observed joint positions (7, rad)."""
        self.q = list(q)
        self.x, self.y, _ = forward(q)
        self.vx = self.vy = 0.0

    def nearest_allowed(self, x: float, y: float) -> tuple[float, float]:
        """The nearest point that the mallet may reach."""
        y = min(max(y, -self.y_max), self.y_max)
        return min(max(x, self.x_min), math.sqrt(REACH**2 - y * y)), y

    def move_to(self, x: float, y: float, speed: float) -> list[list[float]]:
        """One step towards a point (m), at most at `speed` (m/s) and slow enough to brake. Returns the action."""
        x, y = self.nearest_allowed(x, y)
        distance = math.hypot(x - self.x, y - self.y)
        scale = min(speed, math.sqrt(ACCELERATION * distance), 0.5 * distance / self.dt) / max(distance, 1e-6)
        return self.move_at_velocity(scale * (x - self.x), scale * (y - self.y))

    def move_at_velocity(self, vx: float, vy: float) -> list[list[float]]:
        """One step at a desired velocity (m/s), as far as acceleration and joints allow. Returns the action."""
        change = math.hypot(vx - self.vx, vy - self.vy)
        share = min(1.0, ACCELERATION * self.dt / max(change, 1e-9))
        vx, vy = self.vx + share * (vx - self.vx), self.vy + share * (vy - self.vy)
        for _ in range(5):  # attempts
            x, y = self.x + 0.5 * self.dt * (self.vx + vx), self.y + 0.5 * self.dt * (self.vy + vy)
            allowed = self.nearest_allowed(x, y)
            vx, vy = vx * (allowed[0] == x), vy * (allowed[1] == y)
            x, y = allowed
            q, reached = inverse((x, y, self.height))
            speeds = posture_velocities((x, y, self.height), (vx, vy))  # at the end of the step
            mean_speeds = [(end - start) / self.dt for start, end in zip(self.q, q)]
            load = max(speed_share(speeds), speed_share(mean_speeds)) / SPEED_SHARE
            if reached and load <= 1.0:
                self.q, self.x, self.y, self.vx, self.vy = q, x, y, vx, vy
                return [q, speeds]
            # A joint would be too fast, or the point is out of reach: try a slower motion.
            vx, vy = vx / max(load, 1.2), vy / max(load, 1.2)
        self.vx = self.vy = 0.0
        return [self.q, [0.0] * len(self.q)]
