"""Small policies as ONNX models, for the tests of `faceoff.export`."""

from __future__ import annotations

from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper


def linear_policy(inputs: int, outputs: int, *, scale: float = 0.01, bounded: bool = True, **changes: Any) -> onnx.ModelProto:
    """tanh(observation · weights + bias), or without tanh. `changes`: `opset`, `input_shape`, `output_shape`, `type`."""
    draws = np.random.default_rng(0)
    constants = {
        "weights": (scale * draws.standard_normal((inputs, outputs))).astype(np.float32),
        "bias": draws.uniform(-0.2, 0.2, outputs).astype(np.float32),
    }
    last = "sum" if bounded else "action"
    nodes = [helper.make_node("Gemm", ["observation", "weights", "bias"], [last])]
    if bounded:
        nodes.append(helper.make_node("Tanh", ["sum"], ["action"]))
    element = changes.get("type", TensorProto.FLOAT)
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info("observation", element, changes.get("input_shape", ["n", inputs]))],
        [helper.make_tensor_value_info("action", element, changes.get("output_shape", ["n", outputs]))],
        [numpy_helper.from_array(value, name) for name, value in constants.items()],
    )
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", changes.get("opset", 17))], ir_version=8)


def function_of(model: onnx.ModelProto) -> Any:
    """The policy of `linear_policy` in NumPy: (length,) to (length,)."""
    weights, bias = (numpy_helper.to_array(value) for value in model.graph.initializer)
    bounded = any(node.op_type == "Tanh" for node in model.graph.node)

    def act(observation: Any) -> Any:
        total = np.asarray(observation, np.float32) @ weights + bias
        return np.tanh(total) if bounded else total

    return act
