"""Shoots the puck at the opponent's goal: moves behind the puck, accelerates along a line and brakes.

Positions are in the robot's base frame: x points towards the opponent's goal. Units: metres, radians, seconds.
"""

import math

from mallet import Mallet
from protocol import Agent, run
from puck import Puck

SHOT_SPEED = 1.6  # speed of the mallet in a shot, m/s
RUN_UP = 0.16  # distance over which the mallet accelerates to that speed, m
WAIT_SPEED = 0.35  # the agent waits while the puck is faster than this, m/s
WAIT_DISTANCE = 0.14  # distance from the goal line at which the mallet waits, m
MAX_SHOT_STEPS = 20  # longest shot, control steps
SIDEWAYS_GAIN = 6  # speed towards the line of the shot per distance from it, 1/s


class Hitter(Agent):
    interpolation = 3  # an action is the joints' positions and velocities at the end of the step

    def start(self) -> None:
        self.mallet, self.puck = Mallet(self.env), Puck(self.env)
        self.contact_distance = self.puck.radius + self.mallet.radius  # of the centres of puck and mallet, m
        self.opponent_goal = 2 * self.mallet.middle - self.mallet.goal  # x of the opponent's goal line, m
        self.started = False

    def reset(self) -> None:
        self.puck.reset()
        self.started = False
        self.shot: tuple[float, float, int] | None = None  # direction and remaining steps of the current shot

    def act(self, observation: list[float]) -> list[list[float]]:
        mallet, puck = self.mallet, self.puck
        if not self.started:
            mallet.reset(self.joint_positions(observation))
            self.started = True
        puck.observe(*self.puck_state(observation))

        if self.shot:
            return self.shoot(self.shot)
        if puck.speed > WAIT_SPEED or puck.x > mallet.middle - 0.15:
            # The puck is too fast or too far away: wait in front of the goal, on the puck's side.
            return mallet.move_to(mallet.goal + WAIT_DISTANCE, max(-0.1, min(0.1, 0.3 * puck.y)), 1.0)
        # Start behind the puck, on the line from the centre of the opponent's goal through the puck.
        distance = math.hypot(self.opponent_goal - puck.x, puck.y)
        back = self.contact_distance + RUN_UP
        start = mallet.nearest_allowed(
            puck.x - back * (self.opponent_goal - puck.x) / distance, puck.y + back * puck.y / distance
        )
        # Shoot once the mallet is there (m) and almost at rest (m/s).
        if math.dist(start, (mallet.x, mallet.y)) < 0.012 and math.hypot(mallet.vx, mallet.vy) < 0.1:
            length = math.dist(start, (puck.x, puck.y))
            return self.shoot(((puck.x - start[0]) / length, (puck.y - start[1]) / length, MAX_SHOT_STEPS))
        return mallet.move_to(*self.waypoint(*start), 1.0)

    def shoot(self, shot: tuple[float, float, int]) -> list[list[float]]:
        """One step of a shot, or a braking step once it has ended."""
        mallet, puck = self.mallet, self.puck
        dx, dy, steps_left = shot
        ahead = (puck.x - mallet.x) * dx + (puck.y - mallet.y) * dy  # distance of the puck in the shot's direction
        if steps_left == 0 or ahead < 0.0:
            self.shot = None
            return mallet.move_at_velocity(0.0, 0.0)
        # After the contact, two more steps are enough.
        self.shot = (dx, dy, min(steps_left, 2 if ahead < self.contact_distance + 0.005 else steps_left) - 1)
        # Follow the puck sideways, because it may be rolling.
        across = (puck.y - mallet.y) * dx - (puck.x - mallet.x) * dy
        sideways = SIDEWAYS_GAIN * across
        return mallet.move_at_velocity(SHOT_SPEED * dx - sideways * dy, SHOT_SPEED * dy + sideways * dx)

    def waypoint(self, x: float, y: float) -> tuple[float, float]:
        """The target point, or a point beside the puck if the direct path would touch it."""
        mallet, puck, clearance = self.mallet, self.puck, self.contact_distance + 0.02
        distance = max(math.hypot(x - mallet.x, y - mallet.y), 1e-6)
        dx, dy = (x - mallet.x) / distance, (y - mallet.y) / distance
        along = (puck.x - mallet.x) * dx + (puck.y - mallet.y) * dy
        left = (puck.y - mallet.y) * dx - (puck.x - mallet.x) * dy  # puck's offset to the left of the path
        if along < 0.0 or along > distance + clearance or abs(left) > clearance:
            return x, y
        # Pass the puck on the nearer side, or on the other one if the rim is in the way.
        for side in (-1.0, 1.0) if left > 0 else (1.0, -1.0):
            beside = (puck.x - side * dy * (clearance + 0.03), puck.y + side * dx * (clearance + 0.03))
            if mallet.nearest_allowed(*beside) == beside:
                return beside
        return x, y


if __name__ == "__main__":
    run(Hitter)
