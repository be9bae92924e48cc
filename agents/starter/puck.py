"""Estimates and predicts the puck from noisy, sometimes missing observations."""

DRAG = 0.5  # share of its speed that a sliding puck loses per second
RIM = 0.75  # coefficient of restitution of a bounce off a rim
TRUST = 0.35  # weight of one observation in the estimated velocity


class Puck:
    def __init__(self, env):
        self.dt = env["dt"]
        self.y_max = env["table"]["width"] / 2 - env["puck"]["radius"]
        self.reset()

    def reset(self):
        self.x = self.y = self.vx = self.vy = 0.0
        self.last = None

    def observe(self, obs):
        """Updates the estimate with an observation, which begins with x, y, yaw and their rates."""
        x, y, _, vx, vy, _ = obs[:6]
        if self.last is None:
            self.x, self.y, self.vx, self.vy = x, y, vx, vy
        elif (x, y) == self.last and vx == vy == 0.0:
            # Tracking is lost: the old position is repeated with zero velocity. The puck has moved on.
            self.x, self.y, self.vx, self.vy = self.after(self.dt)
        else:
            # Two measurements of the velocity: the reported one, and the displacement since the last step.
            _, _, vx_now, vy_now = self.after(self.dt)
            measured_x = 0.5 * (vx + (x - self.x) / self.dt)
            measured_y = 0.5 * (vy + (y - self.y) / self.dt)
            # After a hit the old estimate is invalid.
            jump = abs(measured_x - vx_now) + abs(measured_y - vy_now) > 0.7
            trust = 1.0 if jump else TRUST
            self.vx = vx_now + trust * (measured_x - vx_now)
            self.vy = vy_now + trust * (measured_y - vy_now)
            self.x, self.y = x, y
        self.last = (x, y)

    def after(self, time):
        """x, y, vx and vy after `time`, s; only bounces off the long rims are modelled."""
        slide = time * (1 - 0.5 * DRAG * min(time, 2.0))
        fade = 1 - DRAG * min(time, 1.9)
        x, y = self.x + self.vx * slide, self.y + self.vy * slide
        vx, vy = self.vx * fade, self.vy * fade
        for _ in range(4):
            if abs(y) <= self.y_max:
                break
            rim = self.y_max if y > 0 else -self.y_max
            y = rim - RIM * (y - rim)
            vy = -RIM * vy
        return x, max(-self.y_max, min(self.y_max, y)), vx, vy

    @property
    def speed(self):
        return (self.vx**2 + self.vy**2) ** 0.5
