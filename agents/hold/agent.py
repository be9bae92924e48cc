"""Holds the robot still, in the pose in which the episode finds it."""

from protocol import play


class Hold:
    """The safest policy there is, and a start for others."""

    def __init__(self, task, agent_id, env):
        self.joint_pos_ids = env["joint_pos_ids"]
        self.pose = None

    def reset(self):
        self.pose = None

    def act(self, obs):
        # The pose is read once. Following the measured one would let the arm sink: gravity pulls it a
        # little below each command, and the next command would start from there.
        if self.pose is None:
            self.pose = [obs[i] for i in self.joint_pos_ids]
        return [self.pose, [0.0] * len(self.pose)]


if __name__ == "__main__":
    # Interpolation 3: an action is the joints' positions and velocities at the end of the step.
    play(Hold, interpolation=3)
