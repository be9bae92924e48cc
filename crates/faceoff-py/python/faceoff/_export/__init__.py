"""Makes a bundle, the folder of an agent, from a trained policy. One file per kind of policy."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

from faceoff._distribution import install_command
from faceoff.errors import ArgumentError, ArgumentTypeError, MissingError

__all__ = ["export"]


def export(
    policy: Any,
    folder: str | os.PathLike[str],
    *,
    env: Any = None,
    task: str | None = None,
    name: str | None = None,
    deterministic: bool = True,
) -> Path:
    """Makes a bundle of a policy, ready for ``faceoff eval`` and ``faceoff submit``.

    The bundle contains the policy as ONNX with its normalisation and limits of actions, an agent that plays it, and the
    parts of this package that the agent needs. Its runtime is ``python3-ml``. The exported graph is compared with the
    policy before anything is written.

    Args:
        policy: an algorithm of Stable-Baselines3; a ``torch.nn.Module`` from observations (n, length) to actions (n,
            length), float32; an agent or actor of CleanRL; or an ONNX model, or its path, with one such input and output.
        folder: the folder to create.
        env: the environment of the training, with its wrappers, for one world or many. Task, action mode,
            interpolation and clipping are read from it; so are ``VecNormalize``, ``NormalizeObservation``,
            ``ClipAction``, ``RescaleAction`` and ``MalletPlane``. By default that of the algorithm.
        task: ``hit``, ``defend`` or ``prepare``: instead of ``env``, for an environment with default arguments.
        name: the agent's name on boards, up to 60 characters; by default the folder's.
        deterministic: only True is possible: the agent plays the policy's mean action.

    Returns:
        The folder's path.

    Raises:
        ArgumentError, ArgumentTypeError: if the policy cannot be exported, or the folder exists.
        MissingError: if ``onnx`` is not installed.
    """
    if deterministic is not True:
        raise ArgumentError(
            f"deterministic: expected True, since an exported agent plays the mean action, got {deterministic!r}: write "
            "an agent that draws its actions (faceoff.agent)"
        )
    try:
        import gymnasium  # noqa: F401
    except ImportError as error:
        raise MissingError(f"faceoff.export needs gymnasium and onnx: {install_command('export')}") from error
    from faceoff._export import bundle, network, onnx_models
    from faceoff._export.environment import default_environment, read_environment

    path = bundle.check_folder(folder)
    agent_name = bundle.check_name(name, path)
    kind = _kind(policy)
    if kind == "stable_baselines3" and env is None:
        from faceoff._export.stable_baselines3 import environment_of

        env = environment_of(policy)
    if env is not None:
        environment = read_environment(env, task)
    elif task is not None:
        environment = default_environment(task)
    else:
        raise ArgumentError(
            "env: expected the environment of the training, or task= for an environment with default arguments, got neither"
        )
    network.import_onnx()
    if kind == "onnx":
        read = onnx_models.read_network(policy, environment.observation_len, environment.action_len)
    elif kind == "stable_baselines3":
        from faceoff._export import stable_baselines3

        read = stable_baselines3.read_network(policy, environment.observation_len)
    else:
        from faceoff._export import torch_modules

        read = torch_modules.read_network(policy, environment.observation_len)
    model = network.make_graph(read, environment)
    network.check_graph(model, read, environment)
    bundle.write(path, agent_name, model, environment)
    return path


def _kind(policy: object) -> str:
    """The kind of a policy: `onnx`, `stable_baselines3` or `torch`.

    Libraries that are not imported yet cannot have made it, so they are not imported here either.
    """
    from faceoff._export import onnx_models

    if onnx_models.is_model(policy):
        return "onnx"
    if "stable_baselines3" in sys.modules:
        from faceoff._export import stable_baselines3

        if stable_baselines3.is_policy(policy):
            return "stable_baselines3"
    torch = sys.modules.get("torch")
    if torch is not None and isinstance(policy, torch.nn.Module):
        return "torch"
    cure = "a function cannot be exported: write an agent that calls it (faceoff.agent)" if callable(policy) else (
        "load it first, or write an agent (faceoff.agent)"
    )
    raise ArgumentTypeError(
        "policy: expected an algorithm of Stable-Baselines3, a torch.nn.Module, an ONNX model or the path of one, "
        f"got {policy!r:.80}; {cure}"
    )
