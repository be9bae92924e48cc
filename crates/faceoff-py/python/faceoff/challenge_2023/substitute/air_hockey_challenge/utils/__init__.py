"""Stands in for the 2023 challenge's package of this name; it is packed into the bundles of agents of 2023."""

from faceoff.challenge_2023._kinematics import forward_kinematics, inverse_kinematics, jacobian
from faceoff.challenge_2023._transformations import robot_to_world, world_to_robot

__all__ = ["forward_kinematics", "inverse_kinematics", "jacobian", "robot_to_world", "world_to_robot"]
