"""A policy's network as ONNX, and the steps around it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from faceoff._distribution import install_command
from faceoff._export.environment import PolicyEnvironment
from faceoff._export.steps import Array, Step, apply_all
from faceoff.errors import ArgumentError, MissingError

#: Names of the exported graph's input and output: (n, observation length) and (n, action length), float32.
INPUT, OUTPUT = "observation", "action"
#: Versions that the runtime's ONNX Runtime reads; ONNX Runtime 1.32.0 read opset 27 in a test.
LATEST_OPSET, LATEST_IR = 26, 11
#: The networks of the tests need no newer one, and older ones are readable everywhere.
OPSET, IR = 17, 8
#: Observations for the comparison of the exported graph with the policy.
SAMPLES = 200
#: The largest accepted difference, as a share of the action's range.
TOLERANCE = 1e-4


def import_onnx() -> Any:
    """The package `onnx`.

    Raises:
        MissingError: if it is not installed.
    """
    try:
        import onnx
        import onnx.checker
        import onnx.compose
        import onnx.numpy_helper
    except ImportError as error:
        raise MissingError(f"faceoff.export needs onnx: {install_command('export')}") from error
    return onnx


@dataclass
class PolicyNetwork:
    """A policy before the environment's wrappers are added."""

    model: Any
    """onnx.ModelProto with one input and one output."""
    predict: Callable[[Array], Array]
    """The policy itself, without ONNX: (n, observation length) float32 to (n, action length)."""
    action_steps: list[Step] = field(default_factory=list)
    """What `predict` does after the network."""


def make_graph(network: PolicyNetwork, environment: PolicyEnvironment) -> Any:
    """The whole policy as an onnx.ModelProto: from the environment's observation to its action."""
    onnx = import_onnx()
    model = onnx.compose.add_prefix(network.model, "policy/")
    graph = model.graph
    stored = {initializer.name for initializer in graph.initializer}
    [policy_input] = [value.name for value in graph.input if value.name not in stored]
    [policy_output] = [value.name for value in graph.output]
    before = _nodes(onnx, graph, environment.observation_steps, INPUT, policy_input, "before")
    after = _nodes(onnx, graph, [*network.action_steps, *environment.action_steps], policy_output, OUTPUT, "after")
    nodes = [*before, *graph.node, *after]
    del graph.node[:], graph.input[:], graph.output[:]
    graph.node.extend(nodes)
    float32, make_info = onnx.TensorProto.FLOAT, onnx.helper.make_tensor_value_info
    graph.input.append(make_info(INPUT, float32, [1, environment.observation_len]))
    graph.output.append(make_info(OUTPUT, float32, [1, environment.action_len]))
    # Shapes of inner values; they are not needed, and a batch of another size would contradict them.
    del graph.value_info[:]
    model.ir_version = min(max(model.ir_version, IR), LATEST_IR)
    try:
        onnx.checker.check_model(model)
    except Exception as error:
        raise ArgumentError(f"policy: expected a valid ONNX graph, got {_first_line(error)}") from error
    return model


def _nodes(onnx: Any, graph: Any, steps: Iterable[Step], first: str, last: str, label: str) -> list[Any]:
    """Nodes for the steps, from the value `first` in single precision to `last` in single precision."""
    types = {np.dtype(np.float32): onnx.TensorProto.FLOAT, np.dtype(np.float64): onnx.TensorProto.DOUBLE}
    nodes: list[Any] = []
    precision, value = np.dtype(np.float32), first

    def add(operator: str, inputs: Sequence[str], **attributes: Any) -> str:
        output = f"{label}/{len(nodes)}"
        nodes.append(onnx.helper.make_node(operator, inputs, [output], **attributes))
        return output

    for step in [*steps, Step("Cast", np.zeros((), np.float32))]:
        wanted = step.operand.dtype if step.operator == "Cast" else np.result_type(precision, step.operand.dtype)
        if wanted != precision:
            value = add("Cast", [value], to=types[wanted])
            precision = wanted
        if step.operator != "Cast":
            name = f"{label}/constant{len(nodes)}"
            graph.initializer.append(onnx.numpy_helper.from_array(np.asarray(step.operand, precision), name))
            value = add(step.operator, [value, name])
    nodes.append(onnx.helper.make_node("Identity", [value], [last]))
    return nodes


def check_graph(model: Any, network: PolicyNetwork, environment: PolicyEnvironment) -> None:
    """Compares the exported graph with the policy itself on observations of the space.

    Raises:
        ArgumentError: if they differ, or if the environment would refuse an action.
    """
    observations = sample_observations(environment)
    seen = apply_all(environment.observation_steps, observations)
    shape = (len(observations), environment.action_len)
    with np.errstate(over="ignore"):
        predicted = np.asarray(network.predict(seen))
        if predicted.shape != shape:
            raise ArgumentError(f"policy: expected actions of shape {shape}, got {predicted.shape}")
        expected = apply_all(environment.action_steps, predicted)
    if not np.isfinite(expected).all():
        raise ArgumentError("policy: expected finite actions for all observations of the space, got NaN or infinity")
    limit = environment.action_limit
    if limit is not None and np.abs(expected).max() > limit:
        raise ArgumentError(
            f"policy: expected actions from -{limit:g} to {limit:g}, which env accepts, got {_farthest(expected)}; wrap "
            "env in ClipAction, make it with clip_actions=True, or bound the policy's output"
        )
    run = _runner(model)
    actions = np.concatenate([run(observation[None]) for observation in observations])
    if actions.shape != shape:
        raise ArgumentError(f"policy: expected actions of shape {shape} from its ONNX graph, got {actions.shape}")
    space = environment.action_space
    tolerance = TOLERANCE * np.maximum(space.high - space.low, np.abs(expected))
    # The negation is true for NaN, too.
    differs = ~(np.abs(actions - expected) <= tolerance)
    if differs.any():
        sample, index = np.argwhere(differs)[0]
        raise ArgumentError(
            "policy: expected the exported ONNX graph to give the policy's actions, got "
            f"{actions[sample, index]} in place of {expected[sample, index]} at index {index}: the network may depend "
            "on random numbers, on a state, or on branches of Python code"
        )


def sample_observations(environment: PolicyEnvironment) -> Array:
    """(SAMPLES, observation length), float32: from the whole space, and closer to its centre, where play happens."""
    space = environment.observation_space
    low, high = (np.tile(bound.astype(np.float64), environment.frames) for bound in (space.low, space.high))
    draws = np.random.default_rng(0).uniform(0.0, 1.0, (SAMPLES, environment.observation_len))
    draws[SAMPLES // 2 :] = 0.5 + 0.1 * (draws[SAMPLES // 2 :] - 0.5)
    observations: Array = (low + draws * (high - low)).astype(np.float32)
    return observations


def _runner(model: Any) -> Callable[[Array], Array]:
    """Runs the graph: in ONNX Runtime, as the agent does, or where that is missing in the reference of `onnx`."""
    try:
        import onnxruntime
    except ImportError:
        from onnx.reference import ReferenceEvaluator

        reference: Any = ReferenceEvaluator(model)
        return lambda observation: np.asarray(reference.run([OUTPUT], {INPUT: observation})[0])
    try:
        session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    except Exception as error:
        raise ArgumentError(f"policy: expected a graph that ONNX Runtime can run, got {_first_line(error)}") from error
    return lambda observation: np.asarray(session.run([OUTPUT], {INPUT: observation})[0])


def _farthest(values: Array) -> float:
    return float(values.flat[int(np.abs(values).argmax())])


def _first_line(error: Exception) -> str:
    text = str(error).strip() or type(error).__name__
    return text.splitlines()[0][:200]


def dimensions(value: Any) -> list[int | None]:
    """The dimensions of a graph's input or output, None where they may vary."""
    shape = value.type.tensor_type.shape.dim
    return [math.floor(dim.dim_value) if dim.HasField("dim_value") else None for dim in shape]
