"""Runs a neural network with ONNX Runtime, after it has checked the promises of the sandbox."""

import importlib.metadata
import os
import sys

import numpy as np
import onnxruntime

from protocol import Agent, run


def check_promises(session):
    """Ends the agent, with the reason in its log, if the runtime differs from docs/sandbox.md."""
    options = session.get_session_options()
    counted = {
        "os.cpu_count": os.cpu_count(),
        "affinity": len(os.sched_getaffinity(0)),
        "OMP_NUM_THREADS": int(os.environ["OMP_NUM_THREADS"]),
        "OPENBLAS_NUM_THREADS": int(os.environ["OPENBLAS_NUM_THREADS"]),
        "ONNX Runtime, intra": options.intra_op_num_threads,
        "ONNX Runtime, inter": options.inter_op_num_threads,
    }
    if len(set(counted.values())) != 1:
        sys.exit(f"expected as many threads as CPUs everywhere, got {counted}")
    packages = {found.name.lower() for found in importlib.metadata.distributions()}
    expected = {"flatbuffers", "numpy", "onnxruntime", "packaging", "protobuf", "scipy"}
    if packages != expected:
        sys.exit(f"expected the packages {sorted(expected)} and no others, got {sorted(packages)}")


class Network(Agent):
    """Holds the initial pose, changed slightly by the network's output for the puck."""

    interpolation = 3

    def start(self):
        self.session = onnxruntime.InferenceSession("policy.onnx", providers=["CPUExecutionProvider"])
        check_promises(self.session)

    def reset(self):
        self.pose = None

    def act(self, obs):
        if self.pose is None:
            self.pose = self.joint_positions(obs)
        state = np.array([[*obs[:6], *self.pose]], dtype=np.float32)
        (joint_pos,) = self.session.run(["joint_pos"], {"state": state})
        return [joint_pos[0].tolist(), [0.0] * len(self.pose)]


if __name__ == "__main__":
    run(Network)
