"""An agent with a trained network in ONNX Runtime."""

import onnxruntime
from faceoff.agent import Agent, run

from player import Player


class Learned(Agent):
    """Lets the network choose the mallet's velocity; `player.py` computes its input and commands the arm."""

    interpolation = 3

    def start(self) -> None:
        session = onnxruntime.InferenceSession("policy.onnx", providers=["CPUExecutionProvider"])
        self.player = Player(lambda features: session.run(["action"], {"view": features})[0])

    def reset(self) -> None:
        self.player.reset()

    def act(self, observation: list[float]) -> object:
        return self.player(observation)


if __name__ == "__main__":
    run(Learned)
