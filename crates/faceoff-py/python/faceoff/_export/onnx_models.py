"""Policies as ONNX models."""

from __future__ import annotations

from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np

from faceoff._export.network import LATEST_OPSET, PolicyNetwork, dimensions, import_onnx
from faceoff._export.steps import Array
from faceoff.errors import ArgumentError


def is_model(policy: object) -> bool:
    """Whether it is an onnx.ModelProto, or a path."""
    if isinstance(policy, (str, PathLike)):
        return True
    return type(policy).__name__ == "ModelProto" and type(policy).__module__.startswith("onnx")


def read_network(policy: Any, observation_len: int, action_len: int) -> PolicyNetwork:
    """The model, with one input (n, observation length) and one output (n, action length), both float32.

    Raises:
        ArgumentError: if the file cannot be read, or the model has other inputs or outputs.
    """
    onnx = import_onnx()
    model = _load(onnx, Path(fspath(policy))) if isinstance(policy, (str, PathLike)) else onnx.ModelProto.FromString(
        policy.SerializeToString()
    )
    try:
        onnx.checker.check_model(model)
    except Exception as error:
        raise ArgumentError(f"policy: expected a valid ONNX model, got {str(error).splitlines()[0]:.200}") from error
    stored = {initializer.name for initializer in model.graph.initializer}
    inputs = [value for value in model.graph.input if value.name not in stored]
    _check_value(onnx, "input", inputs, observation_len)
    _check_value(onnx, "output", list(model.graph.output), action_len)
    for opset in model.opset_import:
        if opset.domain in ("", "ai.onnx") and opset.version > LATEST_OPSET:
            raise ArgumentError(
                f"policy: expected opset {LATEST_OPSET} or earlier, which the runtime reads, got {opset.version}: export "
                "it with opset_version=17"
            )
    predict = _reference(model, inputs[0].name, model.graph.output[0].name)
    return PolicyNetwork(model, predict)


def _load(onnx: Any, path: Path) -> Any:
    if not path.is_file():
        raise ArgumentError(f"policy: expected the file of an ONNX model, found none at {path}")
    try:
        return onnx.load(path)
    except Exception as error:
        raise ArgumentError(f"policy: expected the file of an ONNX model, got {path}, which is none: {error}") from error


def _check_value(onnx: Any, kind: str, values: list[Any], length: int) -> None:
    """Refuses a model without exactly one input (or output) of shape (n, length), float32."""
    if len(values) != 1:
        names = ", ".join(value.name for value in values) or "none"
        raise ArgumentError(f"policy: expected a model with one {kind}, got {len(values)}: {names}")
    [value] = values
    if value.type.tensor_type.elem_type != onnx.TensorProto.FLOAT:
        raise ArgumentError(f"policy: expected float32 as its {kind} {value.name!r}, got another type")
    if not value.type.tensor_type.HasField("shape"):
        return
    shape = dimensions(value)
    if len(shape) != 2 or shape[0] not in (None, 1) or shape[1] not in (None, length):
        got = [("n" if size is None else size) for size in shape]
        raise ArgumentError(f"policy: expected an {kind} of shape (n, {length}), got {got} of {value.name!r}")


def _reference(model: Any, input_name: str, output_name: str) -> Any:
    """The model in the reference evaluator of `onnx`, which is not what the agent runs."""
    from onnx.reference import ReferenceEvaluator

    evaluator: Any = ReferenceEvaluator(model)

    def predict(observations: Array) -> Array:
        rows = [evaluator.run([output_name], {input_name: observation[None]})[0] for observation in observations]
        return np.concatenate([np.asarray(row) for row in rows])

    return predict
