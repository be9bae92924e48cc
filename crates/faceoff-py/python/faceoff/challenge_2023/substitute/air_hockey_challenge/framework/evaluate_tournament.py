from faceoff.challenge_2023._unavailable import PENALTY_POINTS, run_tournament

__all__ = ["PENALTY_POINTS", "run_tournament"]
