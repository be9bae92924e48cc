"""Defends: meets the puck in front of the goal and retreats with it, so that it stops there.

Positions are in the robot's base frame: x points towards the opponent's goal. Units: metres, radians, seconds.
"""

import math

from mallet import Mallet
from protocol import Agent, run
from puck import Puck

INCOMING_VX = -0.3  # a puck with a smaller vx is coming towards our goal, m/s
MEET_DISTANCE = 0.3  # distance from the goal line at which the mallet meets the puck, m
RETREAT_RATIO = 0.31  # a mallet that retreats at this fraction of the puck's speed stops it
RETREAT_TIME = 0.12  # time before the contact at which the mallet begins to retreat, s
WAIT_DISTANCE = 0.14  # distance from the goal line at which the mallet waits, m


class Defender(Agent):
    interpolation = 3  # an action is the joints' positions and velocities at the end of the step

    def start(self) -> None:
        self.mallet, self.puck = Mallet(self.env), Puck(self.env)
        self.contact_distance = self.puck.radius + self.mallet.radius  # of the centres of puck and mallet, m
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

        if puck.vx > INCOMING_VX:
            # The puck is no danger: wait in front of the goal, on the puck's side.
            return mallet.move_to(mallet.goal + WAIT_DISTANCE, max(-0.1, min(0.1, 0.3 * puck.y)), 1.0)
        gap = math.hypot(puck.x - mallet.x, puck.y - mallet.y) - self.contact_distance
        if gap < RETREAT_TIME * puck.speed:
            # The contact is near: retreat in the puck's direction.
            return mallet.move_at_velocity(RETREAT_RATIO * puck.vx, RETREAT_RATIO * puck.vy)
        # Move to the point where the puck will be at the meeting distance.
        meet_x = min(mallet.goal + MEET_DISTANCE, puck.x - self.contact_distance)
        _, meet_y, _, _ = puck.predict((puck.x - self.contact_distance - meet_x) / -puck.vx)
        return mallet.move_to(meet_x, meet_y, 1.5)


if __name__ == "__main__":
    run(Defender)
