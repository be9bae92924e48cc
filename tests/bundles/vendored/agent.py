"""Holds still, once it has found the compiled package that its bundle brings."""

import os
import sys

from markupsafe import _speedups

from protocol import play

if not os.path.realpath(_speedups.__file__).startswith(os.path.realpath("vendor") + "/"):
    sys.exit(f"expected the package of the bundle, got {_speedups.__file__}")


class Hold:
    """The pose that the episode began with."""

    def __init__(self, task, agent_id, env):
        self.joint_pos_ids = env["joint_pos_ids"]
        self.pose = None

    def reset(self):
        self.pose = None

    def act(self, obs):
        if self.pose is None:
            self.pose = [obs[i] for i in self.joint_pos_ids]
        return [self.pose, [0.0] * len(self.pose)]


if __name__ == "__main__":
    play(Hold, interpolation=3)
