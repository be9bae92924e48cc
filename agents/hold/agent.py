"""Holds the robot still, in the pose in which the episode finds it."""

from protocol import Agent, run


class Hold(Agent):
    """The safest policy there is, and a start for others."""

    # Interpolation 3: an action is the joints' positions and velocities at the end of the step.
    interpolation = 3

    def reset(self):
        self.pose = None

    def act(self, observation):
        # The pose is read once. Following the measured one would let the arm sink: gravity pulls it a
        # little below each command, and the next command would start from there.
        if self.pose is None:
            self.pose = self.joint_positions(observation)
        return [self.pose, [0.0] * len(self.pose)]


if __name__ == "__main__":
    run(Hold)
