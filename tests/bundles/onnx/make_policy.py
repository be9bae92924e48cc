"""Writes policy.onnx, a tiny network that almost holds the arm still: python3 make_policy.py (needs numpy and onnx).

Input: `state`, float32 [1, 13]: the puck's pose and velocity as observed (6), and the pose to hold, in radians (7).
Output: `joint_pos`, float32 [1, 7], in radians: that pose, moved by at most 1.6e-4 rad.
"""

from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

INPUTS, HIDDEN, JOINTS = 13, 16, 7


def main() -> None:
    """Draws the weights from a fixed seed and writes the file."""
    rng = np.random.default_rng(13)
    weights = {
        "w1": 0.3 * rng.standard_normal((INPUTS, HIDDEN)),
        "b1": np.zeros(HIDDEN),
        # Of 16 values of at most 1 each, the sum moves no joint by more than 1.6e-4 rad.
        "w2": np.clip(5e-6 * rng.standard_normal((HIDDEN, JOINTS)), -1e-5, 1e-5),
        "pose": np.eye(INPUTS)[:, INPUTS - JOINTS:],
    }
    nodes = [
        helper.make_node("Gemm", ["state", "w1", "b1"], ["sum1"]),
        helper.make_node("Tanh", ["sum1"], ["hidden"]),
        helper.make_node("MatMul", ["hidden", "w2"], ["motion"]),
        helper.make_node("MatMul", ["state", "pose"], ["held"]),
        helper.make_node("Add", ["held", "motion"], ["joint_pos"]),
    ]
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info("state", TensorProto.FLOAT, [1, INPUTS])],
        [helper.make_tensor_value_info("joint_pos", TensorProto.FLOAT, [1, JOINTS])],
        [numpy_helper.from_array(value.astype(np.float32), name) for name, value in weights.items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    onnx.checker.check_model(model)
    onnx.save(model, Path(__file__).with_name("policy.onnx"))


if __name__ == "__main__":
    main()
