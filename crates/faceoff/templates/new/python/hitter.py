"""Strikes the puck at the other goal: gets behind it, accelerates along a line, brakes. Change anything.

Positions are in the robot's own base frame: x grows towards the other goal; metres, radians, seconds.
"""

import math

from mallet import Mallet
from protocol import Agent, run
from puck import Puck

STRIKE = 1.6  # speed of the mallet in a strike, m/s
RUN_UP = 0.16  # and the way on which it gets there, m
SLOW = 0.35  # a faster puck is waited for, m/s


class Hitter(Agent):
    interpolation = 3  # an action is the joints' positions and velocities at the end of the step

    def start(self) -> None:
        self.mallet, self.puck = Mallet(self.env), Puck(self.env)
        self.contact = self.puck.radius + self.mallet.radius
        self.other_goal = 2 * self.mallet.middle - self.mallet.goal
        self.started = False

    def reset(self) -> None:
        self.puck.reset()
        self.started = False
        self.line: tuple[float, float, int] | None = None  # of a strike: direction, steps left

    def act(self, observation: list[float]) -> list[list[float]]:
        mallet, puck = self.mallet, self.puck
        if not self.started:
            mallet.reset(self.joint_positions(observation))
            self.started = True
        puck.observe(*self.puck_state(observation))

        if self.line:
            return self.strike(self.line)
        if puck.speed > SLOW or puck.x > mallet.middle - 0.15:
            return mallet.go(mallet.goal + 0.14, max(-0.1, min(0.1, 0.3 * puck.y)), 1.0)
        # From behind the puck towards the middle of the goal, from as near to that line as the mallet gets.
        way = math.hypot(self.other_goal - puck.x, puck.y)
        back = self.contact + RUN_UP
        start = mallet.inside(
            puck.x - back * (self.other_goal - puck.x) / way, puck.y + back * puck.y / way
        )
        if math.dist(start, (mallet.x, mallet.y)) < 0.012 and math.hypot(mallet.vx, mallet.vy) < 0.1:
            length = math.dist(start, (puck.x, puck.y))
            return self.strike(((puck.x - start[0]) / length, (puck.y - start[1]) / length, 20))
        return mallet.go(*self.around(*start), 1.0)

    def strike(self, line: tuple[float, float, int]) -> list[list[float]]:
        mallet, puck = self.mallet, self.puck
        dx, dy, left = line
        ahead = (puck.x - mallet.x) * dx + (puck.y - mallet.y) * dy
        if left == 0 or ahead < 0.0:
            self.line = None
            return mallet.move(0.0, 0.0)
        # Once it touches the puck, a moment more is enough.
        self.line = (dx, dy, min(left, 2 if ahead < self.contact + 0.005 else left) - 1)
        # Across the line it follows the puck, which may be rolling.
        across = (puck.y - mallet.y) * dx - (puck.x - mallet.x) * dy
        return mallet.move(STRIKE * dx - 6 * across * dy, STRIKE * dy + 6 * across * dx)

    def around(self, x: float, y: float) -> tuple[float, float]:
        """The way to a point that does not lead through the puck: the point, or one beside the puck."""
        mallet, puck, room = self.mallet, self.puck, self.contact + 0.02
        way = max(math.hypot(x - mallet.x, y - mallet.y), 1e-6)
        dx, dy = (x - mallet.x) / way, (y - mallet.y) / way
        along = (puck.x - mallet.x) * dx + (puck.y - mallet.y) * dy
        left = (puck.y - mallet.y) * dx - (puck.x - mallet.x) * dy  # the puck, seen along the way
        if along < 0.0 or along > way + room or abs(left) > room:
            return x, y
        # Pass on the side that is nearer, unless the rim is there.
        for side in (-1.0, 1.0) if left > 0 else (1.0, -1.0):
            beside = (puck.x - side * dy * (room + 0.03), puck.y + side * dx * (room + 0.03))
            if mallet.inside(*beside) == beside:
                return beside
        return x, y


if __name__ == "__main__":
    run(Hitter)
