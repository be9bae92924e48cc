# `import *` of 2023 also gave NumPy and the kinematics functions, on which some agents rely.
import copy

import numpy as np

from faceoff.challenge_2023._constraints import (
    Constraint,
    ConstraintList,
    EndEffectorConstraint,
    JointPositionConstraint,
    JointVelocityConstraint,
    LinkConstraint,
)
from faceoff.challenge_2023._kinematics import forward_kinematics, jacobian

__all__ = [
    "Constraint",
    "ConstraintList",
    "EndEffectorConstraint",
    "JointPositionConstraint",
    "JointVelocityConstraint",
    "LinkConstraint",
    "copy",
    "forward_kinematics",
    "jacobian",
    "np",
]
