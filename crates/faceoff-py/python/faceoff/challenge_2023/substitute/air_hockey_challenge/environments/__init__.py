"""Stands in for the 2023 challenge's package of this name; it is packed into the bundles of agents of 2023.

Importing it raises an error, because bundles have no environments.
"""

from faceoff.challenge_2023._unavailable import missing

raise missing("air_hockey_challenge.environments", "train with the environments of faceoff.gym (docs/python.md)")
