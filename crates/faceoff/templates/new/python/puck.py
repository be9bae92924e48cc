"""Estimates the puck's state from noisy and sometimes missing observations, and predicts its motion."""

import math
from typing import Any

GAIN = 0.35  # weight of a new observation in the velocity estimate
DRAG = 0.5  # fraction of its speed that the puck loses per second
RESTITUTION = 0.75  # fraction of the speed across the rim that remains after a bounce
HIT_CHANGE = 0.7  # a larger change of the velocity (m/s) is a hit or a bounce, not noise


class Puck:
    """Estimated position x, y (m) and velocity vx, vy (m/s) in the robot's base frame."""

    def __init__(self, env: dict[str, Any]) -> None:
        self.dt: float = env["dt"]  # length of a control step, s
        self.radius: float = env["puck"]["radius"]
        self.y_max: float = env["table"]["width"] / 2 - self.radius  # y of a puck that touches the rim
        self.reset()

    def reset(self) -> None:
        self.last_observed: tuple[float, float] | None = None

    def observe(self, x: float, y: float, yaw: float, vx: float, vy: float, yaw_rate: float) -> None:
        """Updates the estimate with an observation."""
        if self.last_observed is None:
            self.x, self.y, self.vx, self.vy = x, y, vx, vy
        elif (x, y) == self.last_observed and vx == vy == 0.0:
            # The puck was not seen and the old position is repeated: predict its motion instead.
            self.x, self.y, self.vx, self.vy = self.predict(self.dt)
        else:
            # There are two measurements of the velocity: the observed one, and the distance since the last step.
            _, _, old_vx, old_vy = self.predict(self.dt)
            new_vx, new_vy = 0.5 * (vx + (x - self.x) / self.dt), 0.5 * (vy + (y - self.y) / self.dt)
            was_hit = abs(new_vx - old_vx) + abs(new_vy - old_vy) > HIT_CHANGE
            gain = 1.0 if was_hit else GAIN
            self.vx, self.vy = old_vx + gain * (new_vx - old_vx), old_vy + gain * (new_vy - old_vy)
            self.x, self.y = x, y
        self.last_observed = (x, y)

    def predict(self, time: float) -> tuple[float, float, float, float]:
        """x, y, vx, vy after some time (s, at most 1.5), with bounces off the long rims but no other contacts."""
        time = min(time, 1.5)
        distance_factor, speed_factor = time * (1 - 0.5 * DRAG * time), 1 - DRAG * time
        x, y = self.x + self.vx * distance_factor, self.y + self.vy * distance_factor
        vx, vy = self.vx * speed_factor, self.vy * speed_factor
        while abs(y) > self.y_max:
            rim = math.copysign(self.y_max, y)
            y, vy = rim - RESTITUTION * (y - rim), -RESTITUTION * vy
        return x, y, vx, vy

    @property
    def speed(self) -> float:
        return math.hypot(self.vx, self.vy)
