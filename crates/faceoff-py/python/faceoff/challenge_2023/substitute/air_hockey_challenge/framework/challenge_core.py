from faceoff.challenge_2023._unavailable import ChallengeCore

__all__ = ["ChallengeCore"]
