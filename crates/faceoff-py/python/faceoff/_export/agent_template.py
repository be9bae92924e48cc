"""Plays the policy in `policy.onnx`. Written by `faceoff.export`; change it as you like.

The graph contains the whole policy: normalisation of the observation, the network, limits of the action.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
from faceoff.actions import ActionFormat, environment_observation
from faceoff.agent import Agent, run

# The training environment. In other tasks the arm holds its start pose.
TASK: str = "defend"
ACTION_MODE: str = "delta"
INTERPOLATION: int | None = 1
CLIP_ACTIONS: bool = False
# The speed of an action of 1, if actions are mallet velocities.
MALLET_SPEED_M_S: float | None = None
# Number of the last observations that the policy gets.
FRAMES: int = 1


class Exported(Agent):
    """An agent that plays an exported policy."""

    interpolation = INTERPOLATION

    def start(self) -> None:
        options = onnxruntime.SessionOptions()
        # A network of this size is faster without other threads.
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        path = Path(__file__).with_name("policy.onnx")
        self.session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
        # The first run is slower than the others, and here no time is measured.
        shape = self.session.get_inputs()[0].shape
        self.session.run(["action"], {"observation": np.zeros(shape, np.float32)})
        self.actions = ActionFormat(ACTION_MODE, INTERPOLATION, CLIP_ACTIONS)
        self.motion: Any = None
        if MALLET_SPEED_M_S is not None:
            from faceoff.kinematics import MalletMotion, native

            self.motion = MalletMotion(1, MALLET_SPEED_M_S, native.inverse)
        hold = ActionFormat("absolute", INTERPOLATION)
        self.hold = hold.command([0.0] * hold.length)

    def reset(self) -> None:
        self.actions.restart()
        # The policy's input: the last observations, the newest at the end; zeros before the first one.
        self.frames: list[float] | None = None
        if self.motion is not None:
            self.motion.restart(np.ones(1, np.bool_))

    def act(self, observation: list[float]) -> Any:
        if self.task != TASK:
            return self.hold
        newest = environment_observation(observation)
        if self.frames is None:
            self.frames = [0.0] * (FRAMES * len(newest))
        self.frames = [*self.frames[len(newest) :], *newest]
        inputs = np.array([self.frames], np.float32)
        [action] = self.session.run(["action"], {"observation": inputs})[0].astype(np.float64)
        if self.motion is not None:
            action = self.motion.command(action[None])[0]
        return self.actions.command(action)


if __name__ == "__main__":
    run(Exported)
