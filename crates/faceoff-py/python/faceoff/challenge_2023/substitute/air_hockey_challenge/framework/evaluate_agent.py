from faceoff.challenge_2023._unavailable import PENALTY_POINTS, evaluate

__all__ = ["PENALTY_POINTS", "evaluate"]
