"""Shared code of the tests of `faceoff.challenge_2023`: the example team, the message `hello`, starting programs."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from program import PROGRAM, REPOSITORY

from faceoff.agent import run
from faceoff.challenge_2023._stand_ins import RobotData, RobotModel
from faceoff.kinematics import model

TEAM = Path(__file__).parent / "team_2023"

#: A configuration in which every answer is in time, however busy the machine is.
LONG_TIME_LIMITS = REPOSITORY / "tests" / "long_time_limits.toml"

HELLO: dict[str, Any] = {
    "type": "hello",
    "protocol": 1,
    "task": "defend",
    "agent_id": 1,
    "env": {
        "dt": 0.02,
        "n_agents": 1,
        "puck_pos_ids": [0, 1, 2],
        "puck_vel_ids": [3, 4, 5],
        "joint_pos_ids": list(range(6, 13)),
        "joint_vel_ids": list(range(13, 20)),
        "opponent_ee_ids": [],
        "table": {"length": 1.948, "width": 1.038, "goal_width": 0.25},
        "puck": {"radius": 0.03165},
        "mallet": {"radius": 0.04815},
        "robot": {
            "n_joints": 7,
            "ee_desired_height": 0.1645,
            "universal_height": 0.0645,
            "control_frequency": 50.0,
            "joint_pos_limit": [[-x for x in model.POSITION_LIMIT_RAD], list(model.POSITION_LIMIT_RAD)],
            "joint_vel_limit": [[-x for x in model.VELOCITY_LIMIT_RAD_S], list(model.VELOCITY_LIMIT_RAD_S)],
            "joint_acc_limit": [
                [-x for x in model.ACCELERATION_LIMIT_RAD_S2],
                list(model.ACCELERATION_LIMIT_RAD_S2),
            ],
            "base_frame": [[[1.0, 0, 0, -1.51], [0, 1.0, 0, 0], [0, 0, 1.0, -0.1], [0, 0, 0, 1.0]]],
        },
        "episode_steps": 500,
        "ruleset": "airhockey-2023.3",
    },
}

ENV: dict[str, Any] = HELLO["env"]

OBSERVATION = [1.0, 0.1, 0.2, -1.0, -0.1, -0.2, *model.START_Q, *[0.0] * 7]

# Base frames (table from robot) of robot 1 and robot 2.
HOME, AWAY = np.eye(4), np.diag([-1.0, -1.0, 1.0, 1.0])
HOME[:3, 3], AWAY[:3, 3] = (-1.51, 0.0, -0.1), (1.51, 0.0, -0.1)

ROBOT = (RobotModel(), RobotData())

# 40 random poses, rad.
Q = np.random.default_rng(0).uniform(-0.9, 0.9, (40, 7)) * model.POSITION_LIMIT_RAD


def convert(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Runs `python -m faceoff.challenge_2023`, which makes a bundle from a team's folder."""
    command = [sys.executable, "-m", "faceoff.challenge_2023", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True)


def program(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Runs `faceoff` without the sandbox, so that agents have this interpreter with NumPy."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    command = [PROGRAM, *map(str, arguments), "--no-sandbox", "--config", LONG_TIME_LIMITS]
    return subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PATH": path})


def answers_of(agent: Any, *messages: dict[str, Any]) -> list[dict[str, Any]]:
    """What the agent's class answers to these messages of the protocol."""
    output = io.BytesIO()
    try:
        run(agent, [json.dumps(message).encode() for message in messages], output)
    except SystemExit:
        pass  # after an error, which is the last answer
    return [json.loads(line) for line in output.getvalue().splitlines()]
