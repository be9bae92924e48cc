from faceoff.challenge_2023._agent_base import AgentBase
from faceoff.challenge_2023._unavailable import AirHockeyChallengeWrapper, ChallengeCore

__all__ = ["AgentBase", "AirHockeyChallengeWrapper", "ChallengeCore"]
