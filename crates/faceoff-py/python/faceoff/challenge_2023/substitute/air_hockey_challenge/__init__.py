"""A substitute of the package of 2023, for agents in a bundle. `faceoff.challenge_2023` has its code."""
