from faceoff.challenge_2023._kinematics import (
    forward_kinematics,
    inverse_kinematics,
    jacobian,
    link_to_xml_name,
)

__all__ = ["forward_kinematics", "inverse_kinematics", "jacobian", "link_to_xml_name"]
