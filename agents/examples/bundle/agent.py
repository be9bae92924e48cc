"""Plays with a trained network, which ONNX Runtime runs."""

import onnxruntime
from faceoff.agent import Agent, run

from player import Player


class Learned(Agent):
    """What is seen of an observation, what the network makes of it, and how the arm follows: see `player.py`."""

    interpolation = 3

    def start(self) -> None:
        session = onnxruntime.InferenceSession("policy.onnx", providers=["CPUExecutionProvider"])
        self.player = Player(lambda seen: session.run(["action"], {"seen": seen})[0])

    def reset(self) -> None:
        self.player.reset()

    def act(self, observation: list[float]) -> object:
        return self.player(observation)


if __name__ == "__main__":
    run(Learned)
