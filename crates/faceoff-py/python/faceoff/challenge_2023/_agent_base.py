"""`air_hockey_challenge.framework.AgentBase`: the class from which agents of 2023 are derived."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

from faceoff.challenge_2023._arguments import Floats, entry
from faceoff.challenge_2023._kinematics import forward_kinematics
from faceoff.challenge_2023._saved_agents import Savable
from faceoff.errors import ArgumentError

Preprocessor = Callable[[Floats], Floats]


class AgentBase(Savable):
    """Derive from it, and write `reset` and `draw_action`.

    Lengths in m, angles in rad; positions in the base frame of the agent's own robot. An observation is (20,), or (23,)
    with an opponent on the table.
    """

    def __init__(self, env_info: dict[str, Any], agent_id: int = 1, **kwargs: Any) -> None:
        #: Spaces and horizon, as MushroomRL describes them.
        self.mdp_info = entry("env_info", env_info, "rl_info")
        self.env_info = env_info
        self.agent_id = agent_id
        self.robot_model = copy.deepcopy(entry("env_info", env_info, "robot", "robot_model"))
        self.robot_data = copy.deepcopy(entry("env_info", env_info, "robot", "robot_data"))
        # Attributes of MushroomRL's agents, which derived classes may set or read.
        self.policy: Any = None
        self.phi: Any = None
        self.next_action: Any = None
        self._preprocessors: list[Preprocessor] = []
        self._logger: Any = None
        self._add_save_attr(
            policy="mushroom",
            phi="mushroom",
            next_action="none",
            mdp_info="mushroom",
            _preprocessors="mushroom",
            _logger="none",
            env_info="none",
            agent_id="none",
            robot_model="none",
            robot_data="none",
        )

    def reset(self) -> None:
        """Called before each episode, and before each rally of a game."""
        raise NotImplementedError(f"{type(self).__name__} has no reset(self)")

    def draw_action(self, observation: Floats) -> Floats:
        """Called at each control step.

        Returns the action of the shape that `interpolation_order` requires; by default (2, 7): the joints' positions
        (rad) and velocities (rad/s) at the end of the step.
        """
        raise NotImplementedError(f"{type(self).__name__} has no draw_action(self, observation)")

    def episode_start(self) -> None:
        """Called before each episode and rally; calls `reset`."""
        self.reset()

    def stop(self) -> None:
        """Called in 2023 at the end of an evaluation. Here the process ends."""

    def fit(self, dataset: Any) -> None:
        """Learning, which is not part of a bundle."""
        raise NotImplementedError(f"{type(self).__name__} has no fit(self, dataset)")

    def set_logger(self, logger: Any, *_: Any) -> None:
        """Keeps a logger of MushroomRL as `_logger`."""
        self._logger = logger

    def add_preprocessor(self, preprocessor: Preprocessor) -> None:
        """Adds a function that is applied to each observation before `draw_action` gets it."""
        self._preprocessors.append(preprocessor)

    @property
    def preprocessors(self) -> list[Preprocessor]:
        """The functions of `add_preprocessor`, in the order of their application."""
        return self._preprocessors

    @classmethod
    def load_agent(cls, path: str | Path, env_info: dict[str, Any], agent_id: int = 1) -> Any:
        """Reads an agent that `save` has written, and gives it `env_info`."""
        agent = cls.load(path)
        agent.env_info, agent.agent_id = env_info, agent_id
        agent.robot_model = copy.deepcopy(entry("env_info", env_info, "robot", "robot_model"))
        agent.robot_data = copy.deepcopy(entry("env_info", env_info, "robot", "robot_data"))
        return agent

    def get_puck_state(self, obs: Floats) -> tuple[Floats, Floats]:
        """`get_puck_pos` and `get_puck_vel`."""
        return self.get_puck_pos(obs), self.get_puck_vel(obs)

    def get_joint_state(self, obs: Floats) -> tuple[Floats, Floats]:
        """`get_joint_pos` and `get_joint_vel`."""
        return self.get_joint_pos(obs), self.get_joint_vel(obs)

    def get_puck_pos(self, obs: Floats) -> Floats:
        """The puck's x, y (m) and yaw (rad): (3,)."""
        return self._part(obs, "puck_pos_ids")

    def get_puck_vel(self, obs: Floats) -> Floats:
        """The puck's velocity along x and y (m/s) and its yaw rate (rad/s): (3,)."""
        return self._part(obs, "puck_vel_ids")

    def get_joint_pos(self, obs: Floats) -> Floats:
        """Joint positions (7,), rad."""
        return self._part(obs, "joint_pos_ids")

    def get_joint_vel(self, obs: Floats) -> Floats:
        """Joint velocities (7,), rad/s, low-pass filtered."""
        return self._part(obs, "joint_vel_ids")

    def get_ee_pose(self, obs: Floats) -> tuple[Floats, Floats]:
        """Position (3,), m, and rotation (3, 3) of the own end effector."""
        return forward_kinematics(self.robot_model, self.robot_data, self.get_joint_pos(obs))

    def _part(self, obs: Floats, key: str) -> Floats:
        try:
            part: Floats = obs[self.env_info[key]]
        except (TypeError, IndexError) as error:
            raise ArgumentError(
                f"obs: expected the array that draw_action gets, of 20 or 23 numbers, got {obs!r:.80}: {error}"
            ) from error
        return part
