"""Where the puck is and where it will be, from observations that are noisy and sometimes missing."""

DRAG = 0.5  # share of its speed that a sliding puck loses per second
RIM = 0.75  # share of its speed across a rim that a bounce leaves
TRUST = 0.35  # how far one observation moves the estimated velocity


class Puck:
    def __init__(self, env):
        self.dt = env["dt"]
        self.y_max = env["table"]["width"] / 2 - env["puck"]["radius"]
        self.reset()

    def reset(self):
        self.x = self.y = self.vx = self.vy = 0.0
        self.last = None

    def observe(self, obs):
        """Takes in an observation: x, y, yaw and their rates come first."""
        x, y, _, vx, vy, _ = obs[:6]
        if self.last is None:
            self.x, self.y, self.vx, self.vy = x, y, vx, vy
        elif (x, y) == self.last and vx == vy == 0.0:
            # Not seen: the old place comes again, with no velocity at all. It will have slid on.
            self.x, self.y, self.vx, self.vy = self.after(self.dt)
        else:
            # Two witnesses for the velocity: what is reported, and the way since the last step.
            _, _, vx_now, vy_now = self.after(self.dt)
            measured_x = 0.5 * (vx + (x - self.x) / self.dt)
            measured_y = 0.5 * (vy + (y - self.y) / self.dt)
            # After a hit, the old estimate is worth nothing.
            jump = abs(measured_x - vx_now) + abs(measured_y - vy_now) > 0.7
            trust = 1.0 if jump else TRUST
            self.vx = vx_now + trust * (measured_x - vx_now)
            self.vy = vy_now + trust * (measured_y - vy_now)
            self.x, self.y = x, y
        self.last = (x, y)

    def after(self, time):
        """x, y, vx and vy after some time; bounces off the long rims count, all else does not."""
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
