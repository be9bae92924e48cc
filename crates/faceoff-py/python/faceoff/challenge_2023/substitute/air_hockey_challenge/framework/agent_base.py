from faceoff.challenge_2023._agent_base import AgentBase

__all__ = ["AgentBase"]
