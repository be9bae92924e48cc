"""Stands in for the 2023 challenge's package of this name; it is packed into the bundles of agents of 2023."""

from faceoff.challenge_2023._agent_base import AgentBase
from faceoff.challenge_2023._unavailable import AirHockeyChallengeWrapper, ChallengeCore

__all__ = ["AgentBase", "AirHockeyChallengeWrapper", "ChallengeCore"]
