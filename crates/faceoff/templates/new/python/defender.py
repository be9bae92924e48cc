"""Defends: meets the puck in front of the goal and gives way, so that it stays there. Change anything.

Positions are in the robot's own base frame: x grows towards the other goal; metres, radians, seconds.
"""

import math

from mallet import Mallet
from protocol import Agent, run
from puck import Puck

INCOMING = -0.3  # a puck with less vx comes at us, m/s
MEET = 0.3  # how far in front of the goal line it is met, m
GIVE_WAY = 0.31  # a mallet that retreats at this share of the puck's speed takes all of it away


class Defender(Agent):
    interpolation = 3  # an action is the joints' positions and velocities at the end of the step

    def start(self) -> None:
        self.mallet, self.puck = Mallet(self.env), Puck(self.env)
        self.contact = self.puck.radius + self.mallet.radius
        self.started = False

    def reset(self) -> None:
        self.puck.reset()
        self.started = False

    def act(self, observation: list[float]) -> list[list[float]]:
        mallet, puck = self.mallet, self.puck
        if not self.started:
            mallet.reset(self.joint_positions(observation))
            self.started = True
        puck.observe(*self.puck_state(observation))

        if puck.vx > INCOMING:
            # Nothing to do: wait in front of the goal, on the puck's side of it.
            return mallet.go(mallet.goal + 0.14, max(-0.1, min(0.1, 0.3 * puck.y)), 1.0)
        gap = math.hypot(puck.x - mallet.x, puck.y - mallet.y) - self.contact
        if gap < 0.12 * puck.speed:
            # It is about to touch: go back with it.
            return mallet.move(GIVE_WAY * puck.vx, GIVE_WAY * puck.vy)
        meet_x = min(mallet.goal + MEET, puck.x - self.contact)
        _, meet_y, _, _ = puck.after((puck.x - self.contact - meet_x) / -puck.vx)
        return mallet.go(meet_x, meet_y, 1.5)


if __name__ == "__main__":
    run(Defender)
