"""`env_info` of 2023, made from the `env` of the protocol's message `hello`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from faceoff.challenge_2023._arguments import Floats, array, entry, number, one_of
from faceoff.challenge_2023._constraints import (
    ConstraintList,
    EndEffectorConstraint,
    JointPositionConstraint,
    JointVelocityConstraint,
    LinkConstraint,
)
from faceoff.challenge_2023._mujoco_model import robot_objects
from faceoff.challenge_2023._stand_ins import Box, MDPInfo
from faceoff.errors import ArgumentTypeError
from faceoff.kinematics import model

ENV_NAMES = {"hit": "7dof-hit", "defend": "7dof-defend", "prepare": "7dof-prepare", "tournament": "tournament"}
"""The protocol's tasks, and the names of their environments in 2023."""

#: Lists of indices of an observation, which are copied from `env`.
_IDS = ("puck_pos_ids", "puck_vel_ids", "joint_pos_ids", "joint_vel_ids", "opponent_ee_ids")
_LIMITS = ("joint_pos_limit", "joint_vel_limit", "joint_acc_limit")
# Discount that the environments of 2023 announced, whatever an agent used.
_GAMMA = 0.99


def env_info(task: str, agent_id: int, env: Mapping[str, Any]) -> dict[str, Any]:
    """The dictionary that `build_agent` got in 2023.

    Args:
        task: `hit`, `defend`, `prepare` or `tournament`.
        agent_id: 1 or 2, the agent's side of the table.
        env: `env` of the message `hello` (docs/protocol.md).

    Lengths in m, angles in rad. `base_frame` always has robot 1 first, because an agent of 2023 takes its robot for
    number 1 on either side: observations are in the own robot's frame, and its opponent's goal is at x > 0 of the
    table's frame.
    """
    one_of("task", task, ENV_NAMES)
    one_of("agent_id", agent_id, (1, 2))
    robot = _robot(agent_id, env)
    n_agents = entry("env", env, "n_agents")
    one_of("env['n_agents']", n_agents, (1, 2))
    info: dict[str, Any] = {
        "table": _numbers(env, "table", "length", "width", "goal_width"),
        "puck": _numbers(env, "puck", "radius"),
        "mallet": _numbers(env, "mallet", "radius"),
        "n_agents": n_agents,
        "robot": robot,
        "dt": number("env['dt']", entry("env", env, "dt")),
        "env_name": ENV_NAMES[task],
    }
    for key in _IDS:
        indices = entry("env", env, key)
        if not isinstance(indices, list) or not all(isinstance(index, int) for index in indices):
            raise ArgumentTypeError(f"env['{key}']: expected a list of indices, got {indices!r:.80}")
        info[key] = list(indices)
    steps = number("env['episode_steps']", entry("env", env, "episode_steps"))
    info["rl_info"] = _rl_info(robot, n_agents, int(steps), info["dt"])
    info["constraints"] = _constraint_list(info)
    return info


def _numbers(env: Mapping[str, Any], key: str, *names: str) -> dict[str, float]:
    """The numbers of a part of `env`."""
    part = entry("env", env, key)
    return {name: number(f"env['{key}']['{name}']", entry(f"env['{key}']", part, name)) for name in names}


def _robot(agent_id: int, env: Mapping[str, Any]) -> dict[str, Any]:
    received = entry("env", env, "robot")
    robot: dict[str, Any] = dict(
        _numbers(env, "robot", "n_joints", "ee_desired_height", "universal_height", "control_frequency")
    )
    robot["control_frequency"] = round(robot["control_frequency"])
    for key in _LIMITS:
        robot[key] = array(f"env['robot']['{key}']", entry("env['robot']", received, key), (2, model.JOINTS))
    base_frames = entry("env['robot']", received, "base_frame")
    if not isinstance(base_frames, list) or not base_frames:
        raise ArgumentTypeError(
            f"env['robot']['base_frame']: expected a list of 4×4 matrices, got {base_frames!r:.60}"
        )
    frames = [array(f"env['robot']['base_frame'][{index}]", frame, (4, 4)) for index, frame in enumerate(base_frames)]
    # The protocol has the agent's own robot first.
    robot["base_frame"] = frames if agent_id == 1 else frames[::-1]
    robot["robot_model"], robot["robot_data"] = robot_objects()
    return robot


def _rl_info(robot: dict[str, Any], n_agents: int, horizon: int, dt: float) -> MDPInfo:
    """Spaces of the environments of 2023: bounds of an observation, and torques of all robots on the table."""
    positions, velocities = robot["joint_pos_limit"], robot["joint_vel_limit"]
    low: Floats = np.concatenate([[0.0, -1.0, -np.pi, -20.0, -20.0, -100.0], positions[0], velocities[0]])
    high: Floats = np.concatenate([[3.02, 1.0, np.pi, 20.0, 20.0, 100.0], positions[1], velocities[1]])
    if n_agents == 2:
        low = np.concatenate([low, [1.5, -1.5, -1.5]])
        high = np.concatenate([high, [4.5, 1.5, 1.5]])
    torques = np.tile(model.TORQUE_LIMIT_N_M, n_agents)
    return MDPInfo(Box(low, high), Box(-torques, torques), _GAMMA, horizon, dt)


def _constraint_list(info: dict[str, Any]) -> ConstraintList:
    constraints = ConstraintList()
    kinds = [JointPositionConstraint, JointVelocityConstraint, EndEffectorConstraint]
    # As in 2023: games had the fourth constraint only in the score.
    if info["env_name"] != "tournament":
        kinds.append(LinkConstraint)
    for kind in kinds:
        constraints.add(kind(info))
    return constraints
