"""Where the puck is and where it will be, from observations that are noisy and sometimes missing."""

import math
from typing import Any

TRUST = 0.35  # how far one observation moves the estimated velocity
DRAG = 0.5  # share of its speed that the puck loses per second
BOUNCE = 0.75  # share of its speed across a rim that a bounce leaves


class Puck:
    """An estimate: x, y (m) and vx, vy (m/s) in the robot's own base frame."""

    def __init__(self, env: dict[str, Any]) -> None:
        self.dt: float = env["dt"]
        self.radius: float = env["puck"]["radius"]
        self.y_max: float = env["table"]["width"] / 2 - self.radius
        self.reset()

    def reset(self) -> None:
        self.seen: tuple[float, float] | None = None

    def observe(self, x: float, y: float, yaw: float, vx: float, vy: float, yaw_rate: float) -> None:
        """Takes in an observation of the puck."""
        if self.seen is None:
            self.x, self.y, self.vx, self.vy = x, y, vx, vy
        elif (x, y) == self.seen and vx == vy == 0.0:
            # Not seen: the old place came again. It will have slid on.
            self.x, self.y, self.vx, self.vy = self.after(self.dt)
        else:
            # Two witnesses for the velocity: what is reported, and the way since the last step.
            _, _, old_vx, old_vy = self.after(self.dt)
            new_vx, new_vy = 0.5 * (vx + (x - self.x) / self.dt), 0.5 * (vy + (y - self.y) / self.dt)
            was_hit = abs(new_vx - old_vx) + abs(new_vy - old_vy) > 0.7
            trust = 1.0 if was_hit else TRUST
            self.vx, self.vy = old_vx + trust * (new_vx - old_vx), old_vy + trust * (new_vy - old_vy)
            self.x, self.y = x, y
        self.seen = (x, y)

    def after(self, time: float) -> tuple[float, float, float, float]:
        """x, y, vx, vy after some time (s, at most 1.5); bounces off the long rims count, all else does not."""
        time = min(time, 1.5)
        slide, fade = time * (1 - 0.5 * DRAG * time), 1 - DRAG * time
        x, y, vx, vy = self.x + self.vx * slide, self.y + self.vy * slide, self.vx * fade, self.vy * fade
        while abs(y) > self.y_max:
            rim = math.copysign(self.y_max, y)
            y, vy = rim - BOUNCE * (y - rim), -BOUNCE * vy
        return x, y, vx, vy

    @property
    def speed(self) -> float:
        return math.hypot(self.vx, self.vy)
