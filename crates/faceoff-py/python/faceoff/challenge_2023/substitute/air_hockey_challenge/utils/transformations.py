from faceoff.challenge_2023._transformations import robot_to_world, world_to_robot

__all__ = ["robot_to_world", "world_to_robot"]
