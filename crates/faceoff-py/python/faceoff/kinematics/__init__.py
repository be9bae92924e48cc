"""Kinematics of the arm: forward and inverse kinematics, velocities, constraints and trajectories of the mallet.

All functions take and return NumPy arrays with any leading dimensions, in the robot's own base frame, in SI units and
radians. `faceoff.kinematics.plain` does the same for one pose with the standard library alone, in one file to copy
into a bundle. `faceoff.kinematics.native` computes most of it in the compiled half of the package, for training.
`faceoff.kinematics.model` has the constants.

The agent's model has seven joints. The mallet hangs on a universal joint that keeps it upright automatically, so
"the mallet's position" is that of the end effector, the rod's tip.
"""

from .limits import Constraints, constraints, speed_share
from .mallet import MalletMotion
from .poses import (
    forward,
    frames,
    heights,
    inverse,
    jacobian,
    posture_velocities,
    velocities,
)
from .trajectory import Trajectory, minimum_jerk, setpoints

__all__ = [
    "Constraints",
    "MalletMotion",
    "Trajectory",
    "constraints",
    "forward",
    "frames",
    "heights",
    "inverse",
    "jacobian",
    "minimum_jerk",
    "posture_velocities",
    "setpoints",
    "speed_share",
    "velocities",
]
