"""Stands in for the 2023 challenge's package of this name; it is packed into the bundles of agents of 2023.

`faceoff.challenge_2023` has its code.
"""
