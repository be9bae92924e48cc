"""Plays the three tasks and whole games with a few rules. A template for your own agent.

All positions are in the robot's own base frame: x grows towards the opponent's goal, the table's centre is
at x = `self.middle`. Both sides of a game see the table alike.
"""

import math

from arm import Arm
from protocol import Agent, run
from puck import Puck

INCOMING = -0.3  # a puck with less vx approaches, m/s
SLOW = 0.35  # only slower pucks are struck, m/s
STRIKE = 1.6  # speed of the mallet in a strike, m/s
RUN_UP = 0.16  # length of the run-up to that speed, metres
PUSH = 0.45  # speed of a push off the rim, m/s
TRAVEL = 1.0  # speed of positioning, m/s
SHARE_TO_STOP = 0.31  # a mallet that retreats at this share of the puck's speed stops it
NEAR_RIM = 0.39  # beyond this |y| the mallet does not fit between puck and rim, metres


class Starter(Agent):
    # Interpolation 3: an action is the joints' positions and velocities at the end of the step.
    interpolation = 3

    def start(self):
        env = self.env
        self.arm = Arm(env)
        self.puck = Puck(env)
        self.middle = self.arm.base
        self.goal = self.middle - env["table"]["length"] / 2
        self.other_goal = self.middle + env["table"]["length"] / 2
        self.contact = env["puck"]["radius"] + env["mallet"]["radius"]

    def reset(self):
        self.puck.reset()
        self.started = False
        self.strike = None  # while striking: direction, speed and steps left

    def act(self, observation):
        if not self.started:
            self.arm.reset(self.joint_positions(observation))
            self.started = True
        self.puck.observe(observation)
        puck = self.puck
        if self.strike:
            return self.go_through()
        if puck.vx < INCOMING:
            return self.defend()
        if puck.x > self.middle - 0.15 or self.task == "defend":
            return self.guard()
        if puck.speed > SLOW:
            return self.guard()
        if self.task == "prepare":
            return self.free()
        return self.attack()

    def guard(self):
        """Waits in front of the goal, on the puck's side of it."""
        y = max(-0.1, min(0.1, 0.3 * self.puck.y))
        x = self.goal + 0.14
        return self.arm.go(self.around(x, y), TRAVEL)

    def defend(self):
        """Intercepts an incoming puck in front of the goal and retreats with it so that it stops."""
        puck = self.puck
        # The interception is at a fixed x, or at the puck if that is nearer.
        meet_x = min(self.goal + 0.3, puck.x - self.contact)
        left = max(0.0, (puck.x - self.contact - meet_x) / -puck.vx)
        _, y, vx, vy = puck.after(left)
        retreat = (SHARE_TO_STOP * vx, SHARE_TO_STOP * vy)
        gap = math.hypot(puck.x - self.arm.pos[0], puck.y - self.arm.pos[1]) - self.contact
        if gap < 0.12 * puck.speed:
            return self.arm.move(*retreat)
        return self.arm.go((meet_x, y), 1.5)

    def attack(self):
        """Strikes the puck at the centre of the opponent's goal; a puck at the rim along the rim."""
        puck = self.puck
        way_x, way_y = self.other_goal - puck.x, -puck.y
        if abs(puck.y) > NEAR_RIM:
            way_y = 0.0
        length = math.hypot(way_x, way_y)
        self.line_up(way_x / length, way_y / length, STRIKE)
        return self.approach()

    def free(self):
        """Pushes a puck at the rim against the rim, so that it bounces towards the middle."""
        puck = self.puck
        if abs(puck.y) < NEAR_RIM - 0.03 and puck.x < self.middle - 0.2:
            return self.guard()  # the puck is well placed
        outwards = 1.0 if puck.y > 0 else -1.0
        # Backward, where a small overshoot does no harm; from the corner forward.
        along = 1.0 if puck.x < self.middle - 0.6 else -1.0
        self.line_up(0.8 * along, 0.6 * outwards, PUSH)
        return self.approach()

    def line_up(self, dx, dy, speed):
        """Plans a strike in the direction (dx, dy): start of the run-up, direction and speed."""
        run_up = RUN_UP * speed / STRIKE
        back = self.contact + run_up
        self.start = self.arm.inside(self.puck.x - back * dx, self.puck.y - back * dy)
        # If the mallet cannot get exactly behind the puck, the strike starts from the nearest possible point.
        to_x, to_y = self.puck.x - self.start[0], self.puck.y - self.start[1]
        length = max(math.hypot(to_x, to_y), 1e-6)
        self.direction = (to_x / length, to_y / length)
        self.speed = speed

    def approach(self):
        """Moves around the puck to the start of the run-up, then begins the strike."""
        x, y = self.start
        away = math.hypot(x - self.arm.pos[0], y - self.arm.pos[1])
        if away < 0.012 and math.hypot(*self.arm.vel) < 0.1:
            steps = 12 + int(8 * STRIKE / self.speed)
            self.strike = (self.direction, self.speed, steps)
            return self.go_through()
        return self.arm.go(self.around(x, y), TRAVEL)

    def go_through(self):
        """Continues a strike: accelerates along its line until contact, then brakes."""
        (dx, dy), speed, left = self.strike
        puck, arm = self.puck, self.arm
        ahead = (puck.x - arm.pos[0]) * dx + (puck.y - arm.pos[1]) * dy
        if left == 0 or ahead < 0.0:
            self.strike = None
            return arm.move(0.0, 0.0)
        # After the contact two more steps are enough.
        if ahead < self.contact + 0.005:
            left = min(left, 2)
        self.strike = ((dx, dy), speed, left - 1)
        # Across the line the mallet follows the puck, which may be rolling.
        across = (puck.x - arm.pos[0]) * -dy + (puck.y - arm.pos[1]) * dx
        return arm.move(speed * dx - 6 * across * dy, speed * dy + 6 * across * dx)

    def around(self, x, y):
        """The next point of a path around the puck: the target itself, or a point beside the puck."""
        from_x, from_y = self.arm.pos
        way_x, way_y = x - from_x, y - from_y
        length = math.hypot(way_x, way_y)
        if length < 1e-6:
            return x, y
        way_x, way_y = way_x / length, way_y / length
        to_x, to_y = self.puck.x - from_x, self.puck.y - from_y
        along = to_x * way_x + to_y * way_y
        side = to_y * way_x - to_x * way_y  # offset of the puck to the left of the path
        clearance = self.contact + 0.02
        if along < 0.0 or along > length + clearance or abs(side) > clearance:
            return x, y
        # Pass on the nearer side, unless the rim is there.
        nearer = -1.0 if side > 0 else 1.0
        for turn in (nearer, -nearer):
            beside_x = self.puck.x - turn * way_y * (clearance + 0.03)
            beside_y = self.puck.y + turn * way_x * (clearance + 0.03)
            if abs(beside_y) < self.arm.y_max and beside_x > self.arm.x_min:
                break
        return beside_x, beside_y


if __name__ == "__main__":
    run(Starter)
