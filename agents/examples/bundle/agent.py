"""An agent with a trained network in ONNX Runtime."""

import onnxruntime
from faceoff.agent import Agent, run

from player import Player


class Learned(Agent):
    """Policy from features through the network to arm commands: see `player.py`."""

    interpolation = 3

    def start(self) -> None:
        session = onnxruntime.InferenceSession("policy.onnx", providers=["CPUExecutionProvider"])
        self.player = Player(lambda view: session.run(["action"], {"view": view})[0])

    def reset(self) -> None:
        self.player.reset()

    def act(self, observation: list[float]) -> object:
        return self.player(observation)


if __name__ == "__main__":
    run(Learned)
