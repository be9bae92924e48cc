from faceoff.challenge_2023._unavailable import AirHockeyChallengeWrapper

__all__ = ["AirHockeyChallengeWrapper"]
