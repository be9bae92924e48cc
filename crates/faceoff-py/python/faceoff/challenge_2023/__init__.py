"""Plays agents of the 2023 Robot Air Hockey Challenge, which were written for the package `air_hockey_challenge`.

`python -m faceoff.challenge_2023 MY_FOLDER BUNDLE` makes a bundle from a team's folder (docs/from-2023.md). The bundle
contains a substitute of `air_hockey_challenge` with the parts that play: `AgentBase`, kinematics, transformations and
constraints. Everything here needs only NumPy. It does not simulate: the simulator is in `faceoff.gym`.

The substitute replaces a package. A stand-in replaces an object of MuJoCo in `env_info`, such as `robot_model`; using an
attribute that it does not have raises `StandInError`.
"""

from faceoff.challenge_2023._adapter import Adapter, adapt, play
from faceoff.challenge_2023._bundle import make_bundle
from faceoff.challenge_2023._env_info import env_info
from faceoff.challenge_2023._loading import install_substitute
from faceoff.challenge_2023._stand_ins import StandInError

__all__ = ["Adapter", "StandInError", "adapt", "env_info", "install_substitute", "make_bundle", "play"]
