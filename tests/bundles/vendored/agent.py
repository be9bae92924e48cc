"""Holds still, after it has checked that it uses the compiled package of its bundle."""

import os
import sys

from markupsafe import _speedups

from protocol import Agent, run

if not os.path.realpath(_speedups.__file__).startswith(os.path.realpath("vendor") + "/"):
    sys.exit(f"expected the package of the bundle, got {_speedups.__file__}")


class Hold(Agent):
    """Holds the initial pose."""

    interpolation = 3

    def reset(self):
        self.pose = None

    def act(self, obs):
        if self.pose is None:
            self.pose = self.joint_positions(obs)
        return [self.pose, [0.0] * len(self.pose)]


if __name__ == "__main__":
    run(Hold)
