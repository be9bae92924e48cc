from faceoff.challenge_2023._unavailable import missing

raise missing("air_hockey_challenge.environments", "train with the environments of faceoff.gym (docs/python.md)")
