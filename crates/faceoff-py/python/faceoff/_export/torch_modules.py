"""Networks of PyTorch, and the agents of CleanRL, which are modules with methods of their own."""

from __future__ import annotations

import inspect
import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from faceoff._export.network import IR, OPSET, PolicyNetwork, import_onnx
from faceoff._export.steps import Array
from faceoff.errors import ArgumentError


def read_network(module: Any, observation_len: int) -> PolicyNetwork:
    """The network from observations to deterministic actions.

    A module with `actor_mean` (CleanRL's PPO) acts by that part, one with `actor` by that one. If `forward` returns a mean
    and a log standard deviation, and the module has `action_scale` and `action_bias` (CleanRL's SAC), the action is the
    squashed mean. Of other modules `forward` returns the action.

    Raises:
        ArgumentError: if the module does not accept observations, or does not return one action each.
    """
    actor = _actor(module)
    is_squashed = all(hasattr(actor, name) for name in ("action_scale", "action_bias", "get_action"))
    import torch

    class Deterministic(torch.nn.Module):  # type: ignore[misc]
        """The mean action."""

        def __init__(self) -> None:
            super().__init__()
            self.actor = actor

        def forward(self, observation: Any) -> Any:
            output = self.actor(observation)
            if is_squashed and isinstance(output, tuple) and len(output) == 2:
                return torch.tanh(output[0]) * self.actor.action_scale + self.actor.action_bias
            return output

    network = Deterministic()

    def predict(observations: Array) -> Array:
        with _evaluation_mode(network), torch.no_grad():
            return np.asarray(network(torch.as_tensor(observations, device=_device(network))).cpu().numpy())

    return PolicyNetwork(trace(network, observation_len), predict)


def _actor(module: Any) -> Any:
    """The part of a module that chooses actions."""
    import torch

    for name in ("actor_mean", "actor"):
        part = getattr(module, name, None)
        if isinstance(part, torch.nn.Module):
            return _actor(part)
    return module


def trace(network: Any, observation_len: int) -> Any:
    """The module as an onnx.ModelProto, for one observation at a time, (1, observation_len) float32.

    Raises:
        ArgumentError: if the module fails, or returns something other than (1, action length) numbers.
        MissingError: if `onnx` is not installed.
    """
    onnx = import_onnx()
    import torch

    observation = torch.zeros(1, observation_len, device=_device(network))
    with _evaluation_mode(network), torch.no_grad():
        try:
            action = network(observation)
        except Exception as error:
            text = (str(error).strip() or type(error).__name__).splitlines()[0]
            raise ArgumentError(
                f"policy: expected a module that accepts observations of shape (1, {observation_len}), float32, "
                f"got {type(error).__name__}: {text:.200}"
            ) from error
        if not isinstance(action, torch.Tensor) or action.ndim != 2 or len(action) != 1:
            got = f"shape {tuple(action.shape)}" if isinstance(action, torch.Tensor) else f"{type(action).__name__}"
            raise ArgumentError(f"policy: expected a module that returns a tensor (1, action length), got {got}")
        # The exporter by tracing needs no package besides onnx, and all versions of PyTorch have it.
        options: dict[str, Any] = {"input_names": ["observation"], "output_names": ["action"], "opset_version": OPSET}
        if "dynamo" in inspect.signature(torch.onnx.export).parameters:
            options["dynamo"] = False
        output = io.BytesIO()
        with warnings.catch_warnings():
            # It warns of its age, and of values that become constants; the comparison afterwards finds wrong ones.
            warnings.simplefilter("ignore")
            try:
                torch.onnx.export(network, (observation,), output, **options)
            except Exception as error:
                text = (str(error).strip() or type(error).__name__).splitlines()[0]
                raise ArgumentError(f"policy: expected a module that PyTorch can export, got {text:.200}") from error
    model = onnx.load_model_from_string(output.getvalue())
    model.ir_version = IR
    return model


@contextmanager
def _evaluation_mode(network: Any) -> Iterator[None]:
    """Switches off dropout and the like, and restores each part's mode afterwards."""
    modes = [(part, part.training) for part in network.modules()]
    network.eval()
    try:
        yield
    finally:
        for part, is_training in modes:
            part.training = is_training


def _device(network: Any) -> Any:
    """Where the module's numbers are; the CPU if it has none."""
    numbers = next(iter([*network.parameters(), *network.buffers()]), None)
    return "cpu" if numbers is None else numbers.device
