"""Estimates and predicts the puck from noisy, sometimes missing observations."""

DRAG = 0.5  # share of its speed that a sliding puck loses per second
RIM_RESTITUTION = 0.75  # coefficient of restitution of a bounce off a rim
HIT_CHANGE = 0.7  # a larger change of the velocity means that something hit the puck, m/s
VELOCITY_GAIN = 0.35  # weight of one observation in the estimated velocity


class Puck:
    """Estimated position (m) and velocity (m/s) of the puck in the robot's base frame."""

    def __init__(self, env):
        self.dt = env["dt"]
        self.y_max = env["table"]["width"] / 2 - env["puck"]["radius"]
        self.reset()

    def reset(self):
        self.x = self.y = self.vx = self.vy = 0.0
        self.last_position = None

    def observe(self, observation):
        """Updates the estimate with an observation, which begins with x, y, yaw and their rates."""
        x, y, _, vx, vy, _ = observation[:6]
        if self.last_position is None:
            self.x, self.y, self.vx, self.vy = x, y, vx, vy
        elif (x, y) == self.last_position and vx == vy == 0.0:
            # Tracking is lost: the last position is repeated with zero velocity, while the puck moves on.
            self.x, self.y, self.vx, self.vy = self.predict(self.dt)
        else:
            # Two measurements of the velocity: the reported one, and the displacement since the last step.
            _, _, predicted_vx, predicted_vy = self.predict(self.dt)
            measured_vx = 0.5 * (vx + (x - self.x) / self.dt)
            measured_vy = 0.5 * (vy + (y - self.y) / self.dt)
            # After a hit the old estimate is invalid.
            is_hit = abs(measured_vx - predicted_vx) + abs(measured_vy - predicted_vy) > HIT_CHANGE
            gain = 1.0 if is_hit else VELOCITY_GAIN
            self.vx = predicted_vx + gain * (measured_vx - predicted_vx)
            self.vy = predicted_vy + gain * (measured_vy - predicted_vy)
            self.x, self.y = x, y
        self.last_position = (x, y)

    def predict(self, time):
        """x, y, vx and vy in `time` seconds; only bounces off the table's long rims are modelled."""
        slide = time * (1 - 0.5 * DRAG * min(time, 2.0))
        fade = 1 - DRAG * min(time, 1.9)
        x, y = self.x + self.vx * slide, self.y + self.vy * slide
        vx, vy = self.vx * fade, self.vy * fade
        for _ in range(4):
            if abs(y) <= self.y_max:
                break
            rim = self.y_max if y > 0 else -self.y_max
            y = rim - RIM_RESTITUTION * (y - rim)
            vy = -RIM_RESTITUTION * vy
        return x, max(-self.y_max, min(self.y_max, y)), vx, vy

    @property
    def speed(self):
        return (self.vx**2 + self.vy**2) ** 0.5
