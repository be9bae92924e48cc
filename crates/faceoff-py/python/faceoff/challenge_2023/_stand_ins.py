"""Stand-ins for objects of other packages that agents of 2023 find in ``env_info``."""

from __future__ import annotations

from typing import Any

import numpy as np

from faceoff.challenge_2023._arguments import Floats
from faceoff.errors import Error
from faceoff.kinematics import model


class StandInError(Error, AttributeError):
    """An attribute of a MuJoCo object in ``env_info`` that its stand-in does not have."""


class _StandIn:
    """Refuses unknown attributes with the known ones."""

    _replaces = ""

    def __getattr__(self, name: str) -> Any:
        # Protocols such as copy and pickle ask for special methods and expect a plain AttributeError.
        if name.startswith("__"):
            raise AttributeError(name)
        known = ", ".join(sorted(vars(self)))
        raise StandInError(
            f"{self._replaces}.{name}: expected one of {known}, because MuJoCo is not installed; use "
            "forward_kinematics, inverse_kinematics and jacobian of air_hockey_challenge.utils, or bring MuJoCo in a "
            "container image"
        )


class RobotModel(_StandIn):
    """``env_info["robot"]["robot_model"]``: the first argument of the kinematics functions."""

    _replaces = "robot_model"

    def __init__(self) -> None:
        self.nq: int = model.JOINTS
        self.nv: int = model.JOINTS
        positions = np.array(model.POSITION_LIMIT_RAD)
        torques = np.array(model.TORQUE_LIMIT_N_M)
        #: Joint positions, (7, 2): lowest and highest, rad.
        self.jnt_range: Floats = np.stack([-positions, positions], axis=1)
        #: Torques, (7, 2): lowest and highest, N m.
        self.actuator_ctrlrange: Floats = np.stack([-torques, torques], axis=1)


class RobotData(_StandIn):
    """``env_info["robot"]["robot_data"]``: the second argument of the kinematics functions."""

    _replaces = "robot_data"

    def __init__(self) -> None:
        #: The joint positions of the last call of a kinematics function, (7,), rad.
        self.qpos: Floats = np.zeros(model.JOINTS)


class Box:
    """A space of MushroomRL: bounds of an array, both included."""

    def __init__(self, low: Floats, high: Floats) -> None:
        self._low, self._high = low, high

    @property
    def low(self) -> Floats:
        return self._low

    @property
    def high(self) -> Floats:
        return self._high

    @property
    def shape(self) -> tuple[int, ...]:
        return self._low.shape


class MDPInfo:
    """``env_info["rl_info"]``: spaces, discount and horizon as MushroomRL describes them."""

    def __init__(self, observation_space: Box, action_space: Box, gamma: float, horizon: int, dt: float = 0.1) -> None:
        self.observation_space = observation_space
        #: Torques of all robots on the table, ± N m: the space of the simulator of 2023, not that of `draw_action`.
        self.action_space = action_space
        self.gamma = gamma
        #: Control steps of an episode, or of a whole game.
        self.horizon = horizon
        #: Duration of a control step, s.
        self.dt = dt

    @property
    def size(self) -> tuple[int, ...]:
        return self.shape

    @property
    def shape(self) -> tuple[int, ...]:
        """Length of an observation, then of the simulator's action."""
        return self.observation_space.shape + self.action_space.shape
