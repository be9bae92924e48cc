"""Moves the mallet: a wanted velocity in the table's plane becomes joint angles and speeds within the limits."""

import math
from collections.abc import Sequence
from typing import Any

from kinematics import forward, inverse, posture_velocities, speed_share

ACCELERATION = 8.0  # of the mallet, m/s²
SPEED_SHARE = 0.85  # of the joint speeds that the rules allow; the rest is for the controller's errors
REACH = 1.25  # how far from its base the arm goes, m
ROOM = 0.015  # kept to the edge of the mallet's area, m


class Mallet:
    """A reference that starts where the arm is, and that the arm follows. All in the robot's own base frame."""

    def __init__(self, env: dict[str, Any]) -> None:
        robot, table = env["robot"], env["table"]
        self.dt: float = env["dt"]
        self.radius: float = env["mallet"]["radius"]
        self.height: float = robot["ee_desired_height"]
        self.middle: float = abs(robot["base_frame"][0][0][3])  # x of the table's centre
        self.goal: float = self.middle - table["length"] / 2  # x of our goal line
        self.x_min: float = self.goal + self.radius + ROOM
        self.y_max: float = table["width"] / 2 - self.radius - ROOM

    def reset(self, q: Sequence[float]) -> None:
        """Begins an episode at rest, at the joint angles (7, rad) that were seen."""
        self.q = list(q)
        self.x, self.y, _ = forward(q)
        self.vx = self.vy = 0.0

    def inside(self, x: float, y: float) -> tuple[float, float]:
        """The nearest point that the mallet may go to."""
        y = min(max(y, -self.y_max), self.y_max)
        return min(max(x, self.x_min), math.sqrt(REACH**2 - y * y)), y

    def go(self, x: float, y: float, speed: float) -> list[list[float]]:
        """One step towards a point (m), at most at `speed` (m/s), and no faster than it can still brake."""
        x, y = self.inside(x, y)
        away = math.hypot(x - self.x, y - self.y)
        wish = min(speed, math.sqrt(ACCELERATION * away), 0.5 * away / self.dt) / max(away, 1e-6)
        return self.move(wish * (x - self.x), wish * (y - self.y))

    def move(self, vx: float, vy: float) -> list[list[float]]:
        """One step at a wanted velocity (m/s), as far as acceleration and joints allow: the action."""
        change = math.hypot(vx - self.vx, vy - self.vy)
        share = min(1.0, ACCELERATION * self.dt / max(change, 1e-9))
        vx, vy = self.vx + share * (vx - self.vx), self.vy + share * (vy - self.vy)
        for _ in range(5):
            x, y = self.x + 0.5 * self.dt * (self.vx + vx), self.y + 0.5 * self.dt * (self.vy + vy)
            inside = self.inside(x, y)
            vx, vy = vx * (inside[0] == x), vy * (inside[1] == y)
            x, y = inside
            q, reached = inverse((x, y, self.height))
            speeds = posture_velocities((x, y, self.height), (vx, vy))
            steps = [(b - a) / self.dt for a, b in zip(self.q, q)]
            load = max(speed_share(speeds), speed_share(steps)) / SPEED_SHARE
            if reached and load <= 1.0:
                self.q, self.x, self.y, self.vx, self.vy = q, x, y, vx, vy
                return [q, speeds]
            # Too fast for a joint, or out of reach: more slowly.
            vx, vy = vx / max(load, 1.2), vy / max(load, 1.2)
        self.vx = self.vy = 0.0
        return [self.q, [0.0] * len(self.q)]
