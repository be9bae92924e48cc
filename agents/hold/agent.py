"""Holds the robot still in its first pose of each episode."""

from protocol import Agent, run


class Hold(Agent):
    """The simplest safe policy, and a template for others."""

    # Interpolation 3: an action is the joints' positions and velocities at the end of the step.
    interpolation = 3

    def reset(self):
        self.pose = None

    def act(self, observation):
        # The pose is read once. With the measured pose of each step the arm would sink: gravity pulls it
        # a little below each command, and the next command would start from there.
        if self.pose is None:
            self.pose = self.joint_positions(observation)
        return [self.pose, [0.0] * len(self.pose)]


if __name__ == "__main__":
    run(Hold)
