"""Policies in this process and agents in the evaluator, for the tests of `faceoff.export`."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from faceoff.actions import environment_observation
from faceoff.kinematics import MalletMotion, native
from stable_baselines3.common.vec_env import VecNormalize

ROOT = Path(__file__).resolve().parents[3]
TARGET = Path(os.environ.get("TARGET_DIR", ROOT / "target"))
PROGRAM = Path(os.environ.get("FACEOFF_BIN", TARGET / "release" / "faceoff"))


def configuration() -> str:
    """A configuration with this environment as the runtime of agents, and with time limits that no machine reaches."""
    limits = (ROOT / "tests" / "long_time_limits.toml").read_text()
    return f'{limits}[runtimes.python3-ml]\nfolder = "{sys.prefix}"\n'


def played(folder: Path, task: str, episodes: int, scratch: Path) -> dict[str, Any]:
    """The result of the agent in `faceoff eval --seed 0`."""
    config = scratch / "faceoff.toml"
    config.write_text(configuration())
    command = [PROGRAM, "eval", folder, "--task", task, "--episodes", str(episodes), "--json", "--config", config]
    done = subprocess.run([*command, "--out", scratch / "result"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr + done.stdout
    answer = json.loads(done.stdout)
    assert answer["faults"] == []
    result: dict[str, Any] = answer["result"]["tasks"][task]
    return result


class Policy:
    """A function from an environment's observations to its actions, for `faceoff.evaluate`.

    It gets the last `frames` observations, zeros before the first one. With `mallet_speed_m_s` its actions are mallet velocities.
    """

    def __init__(self, act: Callable[[Any], Any], mallet_speed_m_s: float | None = None, frames: int = 1) -> None:
        self.act = act
        self.frame_count = frames
        self.mallet_speed_m_s = mallet_speed_m_s
        self.motion = None if mallet_speed_m_s is None else MalletMotion(1, mallet_speed_m_s, native.inverse)

    def reset(self, task: str, episode: int) -> None:
        self.frames = np.zeros((self.frame_count, 20), np.float32)
        if self.motion is not None:
            self.motion.restart(np.ones(1, np.bool_))

    def __call__(self, observation: Any) -> Any:
        self.frames = np.roll(self.frames, -1, axis=0)
        self.frames[-1] = environment_observation(observation)
        action = np.asarray(self.act(self.frames.reshape(-1)), np.float64)
        return action if self.motion is None else self.motion.command(action[None])[0]


def sb3_action(model: Any) -> Callable[[Any], Any]:
    """What `predict` answers to an observation of the world, with the normalisation of the model's environment."""
    normaliser = model.get_env() if isinstance(model.get_env(), VecNormalize) else None

    def act(observation: Any) -> Any:
        seen = observation[None] if normaliser is None else normaliser.normalize_obs(observation[None])
        return model.predict(seen, deterministic=True)[0][0]

    return act
