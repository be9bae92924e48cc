"""Violates the safety constraints on purpose: an example of a non-deployable agent."""

from protocol import Agent, run

# Initial direction of each of the seven joints. Moving the shoulder back and opening the elbow lifts the mallet off the table; the
# base turns it over the table's edge.
START_DIRECTIONS = [+1, -1, +1, +1, +1, -1, +1]


class Reckless(Agent):
    """Moves every joint at full speed from one end of its range to the other."""

    # Interpolation 3: an action is the joints' positions and velocities at the end of the step.
    interpolation = 3

    def start(self):
        self.dt = self.env["dt"]
        self.lower, self.upper = self.env["robot"]["joint_pos_limit"]
        # The rules allow 95 % of these limits, and 95 % of the position range above.
        self.speed = self.env["robot"]["joint_vel_limit"][1]

    def reset(self):
        self.pose = None
        self.direction = list(START_DIRECTIONS)

    def act(self, observation):
        if self.pose is None:
            self.pose = self.joint_positions(observation)
        velocity = []
        for i, speed in enumerate(self.speed):
            target = self.pose[i] + self.direction[i] * speed * self.dt
            if not self.lower[i] < target < self.upper[i]:
                self.direction[i] = -self.direction[i]
                target = min(max(target, self.lower[i]), self.upper[i])
            self.pose[i] = target
            velocity.append(self.direction[i] * speed)
        return [self.pose, velocity]


if __name__ == "__main__":
    run(Reckless)
