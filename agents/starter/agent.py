"""Plays the three tasks and whole games with a few rules. A template for your own agent.

All positions are in the robot's own base frame: x grows towards the opponent's goal, the table's centre is
at x = `self.middle_x`. Both sides of a game see the table alike.
"""

import math

from arm import Arm
from protocol import Agent, run
from puck import Puck

INCOMING_VX = -0.3  # a puck whose velocity along x is lower approaches the own goal, m/s
STRIKEABLE_SPEED = 0.35  # only slower pucks are struck, m/s
STRIKE_SPEED = 1.6  # speed of the mallet in a strike, m/s
RUN_UP_LENGTH = 0.16  # length of the run-up to that speed, metres
PUSH_SPEED = 0.45  # speed of a push off the rim, m/s
TRAVEL_SPEED = 1.0  # speed of the mallet between strikes, m/s
LATERAL_GAIN = 6  # velocity across a strike's line per distance from it, 1/s
RETREAT_SHARE = 0.31  # a mallet that retreats at this share of the puck's speed stops it
SHOT_Y_MAX = 0.39  # beyond this |y| the mallet does not fit between puck and rim, metres


class Starter(Agent):
    """Guards the goal, stops incoming pucks, strikes slow ones, and pushes pucks off the rim."""

    # Interpolation 3: an action is the joints' positions and velocities at the end of the step.
    interpolation = 3

    def start(self):
        env = self.env
        self.arm = Arm(env)
        self.puck = Puck(env)
        self.middle_x = self.arm.base_distance
        self.own_goal_x = self.middle_x - env["table"]["length"] / 2
        self.opponent_goal_x = self.middle_x + env["table"]["length"] / 2
        self.contact_distance = env["puck"]["radius"] + env["mallet"]["radius"]

    def reset(self):
        self.puck.reset()
        self.is_started = False
        self.running_strike = None  # while striking: direction, speed and control steps left

    def act(self, observation):
        if not self.is_started:
            self.arm.reset(self.joint_positions(observation))
            self.is_started = True
        self.puck.observe(observation)
        puck = self.puck
        if self.running_strike:
            return self.continue_strike()
        if puck.vx < INCOMING_VX:
            return self.defend()
        if puck.x > self.middle_x - 0.15 or self.task == "defend":
            return self.guard()
        if puck.speed > STRIKEABLE_SPEED:
            return self.guard()
        if self.task == "prepare":
            return self.free_puck()
        return self.attack()

    def guard(self):
        """Waits in front of the goal, on the puck's side of it."""
        y = max(-0.1, min(0.1, 0.3 * self.puck.y))
        x = self.own_goal_x + 0.14
        return self.arm.move_to(self.point_around_puck(x, y), TRAVEL_SPEED)

    def defend(self):
        """Intercepts an incoming puck in front of the goal and retreats with it so that it stops."""
        puck = self.puck
        # The interception is at a fixed x, or at the puck if that is nearer.
        interception_x = min(self.own_goal_x + 0.3, puck.x - self.contact_distance)
        time_left = max(0.0, (puck.x - self.contact_distance - interception_x) / -puck.vx)
        _, y, vx, vy = puck.predict(time_left)
        retreat = (RETREAT_SHARE * vx, RETREAT_SHARE * vy)
        gap = math.hypot(puck.x - self.arm.pos[0], puck.y - self.arm.pos[1]) - self.contact_distance
        if gap < 0.12 * puck.speed:
            return self.arm.move(*retreat)
        return self.arm.move_to((interception_x, y), 1.5)

    def attack(self):
        """Strikes the puck at the centre of the opponent's goal; a puck at the rim along the rim."""
        puck = self.puck
        path_x, path_y = self.opponent_goal_x - puck.x, -puck.y
        if abs(puck.y) > SHOT_Y_MAX:
            path_y = 0.0
        length = math.hypot(path_x, path_y)
        self.line_up(path_x / length, path_y / length, STRIKE_SPEED)
        return self.approach()

    def free_puck(self):
        """Pushes a puck at the rim against the rim, so that it bounces towards the middle."""
        puck = self.puck
        if abs(puck.y) < SHOT_Y_MAX - 0.03 and puck.x < self.middle_x - 0.2:
            return self.guard()  # the puck can be shot from here
        outwards = 1.0 if puck.y > 0 else -1.0
        # Backward, where a small overshoot does no harm; from the corner forward.
        along = 1.0 if puck.x < self.middle_x - 0.6 else -1.0
        self.line_up(0.8 * along, 0.6 * outwards, PUSH_SPEED)
        return self.approach()

    def line_up(self, dx, dy, speed):
        """Plans a strike in the direction (dx, dy), a unit vector: start of the run-up, direction and speed."""
        run_up = RUN_UP_LENGTH * speed / STRIKE_SPEED
        start_distance = self.contact_distance + run_up
        start_x, start_y = self.puck.x - start_distance * dx, self.puck.y - start_distance * dy
        self.run_up_start = self.arm.nearest_allowed(start_x, start_y)
        # If the mallet cannot get exactly behind the puck, the strike starts from the nearest possible point.
        to_x, to_y = self.puck.x - self.run_up_start[0], self.puck.y - self.run_up_start[1]
        length = max(math.hypot(to_x, to_y), 1e-6)
        self.direction = (to_x / length, to_y / length)
        self.speed = speed

    def approach(self):
        """Moves around the puck to the start of the run-up, then begins the strike."""
        x, y = self.run_up_start
        distance = math.hypot(x - self.arm.pos[0], y - self.arm.pos[1])
        if distance < 0.012 and math.hypot(*self.arm.vel) < 0.1:
            steps = 12 + int(8 * STRIKE_SPEED / self.speed)
            self.running_strike = (self.direction, self.speed, steps)
            return self.continue_strike()
        return self.arm.move_to(self.point_around_puck(x, y), TRAVEL_SPEED)

    def continue_strike(self):
        """Continues a strike: accelerates along its line until contact, then brakes."""
        (dx, dy), speed, steps_left = self.running_strike
        puck, arm = self.puck, self.arm
        ahead = (puck.x - arm.pos[0]) * dx + (puck.y - arm.pos[1]) * dy
        if steps_left == 0 or ahead < 0.0:
            self.running_strike = None
            return arm.move(0.0, 0.0)
        # After the contact two more steps are enough.
        if ahead < self.contact_distance + 0.005:
            steps_left = min(steps_left, 2)
        self.running_strike = ((dx, dy), speed, steps_left - 1)
        # Across the line the mallet follows the puck, which may be rolling.
        across = (puck.x - arm.pos[0]) * -dy + (puck.y - arm.pos[1]) * dx
        return arm.move(speed * dx - LATERAL_GAIN * across * dy, speed * dy + LATERAL_GAIN * across * dx)

    def point_around_puck(self, x, y):
        """The next point of a path around the puck: the target itself, or a point beside the puck."""
        from_x, from_y = self.arm.pos
        path_x, path_y = x - from_x, y - from_y
        length = math.hypot(path_x, path_y)
        if length < 1e-6:
            return x, y
        path_x, path_y = path_x / length, path_y / length
        to_x, to_y = self.puck.x - from_x, self.puck.y - from_y
        along = to_x * path_x + to_y * path_y
        side = to_y * path_x - to_x * path_y  # offset of the puck to the left of the path
        clearance = self.contact_distance + 0.02
        if along < 0.0 or along > length + clearance or abs(side) > clearance:
            return x, y
        # Pass on the nearer side, unless the rim is there.
        nearer_side = -1.0 if side > 0 else 1.0
        for pass_side in (nearer_side, -nearer_side):
            beside_x = self.puck.x - pass_side * path_y * (clearance + 0.03)
            beside_y = self.puck.y + pass_side * path_x * (clearance + 0.03)
            if abs(beside_y) < self.arm.y_max and beside_x > self.arm.x_min:
                break
        return beside_x, beside_y


if __name__ == "__main__":
    run(Starter)
