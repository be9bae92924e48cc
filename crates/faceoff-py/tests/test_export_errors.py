"""`faceoff.export` refuses what it cannot export, says what came and what to do, and leaves nothing behind."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import onnx
import pytest
from gymnasium import wrappers
from gymnasium.vector import AsyncVectorEnv
from onnx import TensorProto, helper

import faceoff
from faceoff.gym import AirHockeyEnv, MalletPlane
from onnx_policies import linear_policy

MODEL = linear_policy(20, 7)


class Doubling(gymnasium.Wrapper[Any, Any, Any, Any]):
    """A wrapper that changes actions in a way that only its code tells."""

    def step(self, action: Any) -> Any:
        return self.env.step(np.clip(2.0 * action, -1.0, 1.0))


class Annotated(gymnasium.Wrapper[Any, Any, Any, Any]):
    """A wrapper that changes neither observations nor actions."""

    note = "first training"


class OwnEnv(AirHockeyEnv):
    """An environment with a step of its own."""

    def step(self, action: Any) -> Any:
        return super().step(-np.asarray(action))


def two_inputs() -> onnx.ModelProto:
    model = linear_policy(20, 7)
    model.graph.input.append(helper.make_tensor_value_info("state", TensorProto.FLOAT, ["n", 4]))
    return model


def random_policy() -> onnx.ModelProto:
    """Its output is different at each run."""
    model = linear_policy(20, 7)
    mean, tanh = list(model.graph.node)
    mean.output[0] = "mean"
    noise = helper.make_node("RandomNormalLike", ["mean"], ["noise"], scale=0.1)
    total = helper.make_node("Add", ["mean", "noise"], ["sum"])
    del model.graph.node[:]
    model.graph.node.extend([mean, noise, total, tanh])
    return model


POLICIES: list[tuple[Callable[[], Any], str]] = [
    (lambda: (lambda observation: np.zeros(7)), "a function cannot be exported: write an agent that calls it (faceoff.agent)"),
    (lambda: 3, "policy: expected an algorithm of Stable-Baselines3, a torch.nn.Module, an ONNX model"),
    (lambda: None, "got None"),
    (lambda: "missing.onnx", "policy: expected the file of an ONNX model, found none at missing.onnx"),
    (lambda: __file__, "test_export_errors.py, which is none"),
    (lambda: linear_policy(23, 7), "policy: expected an input of shape (n, 20), got ['n', 23] of 'observation'"),
    (lambda: linear_policy(20, 14), "policy: expected an output of shape (n, 7), got ['n', 14] of 'action'"),
    (lambda: linear_policy(20, 7, input_shape=["n", 4, 5]), "expected an input of shape (n, 20), got ['n', 4, 5]"),
    (lambda: linear_policy(20, 7, input_shape=[8, 20]), "expected an input of shape (n, 20), got [8, 20]"),
    (lambda: linear_policy(20, 7, scale=1e38, bounded=False), "expected finite actions for all observations of the space"),
    (lambda: linear_policy(20, 7, type=TensorProto.DOUBLE), "expected float32 as its input 'observation'"),
    (lambda: linear_policy(20, 7, opset=28), "policy: expected opset 26 or earlier, which the runtime reads, got 28"),
    (lambda: linear_policy(20, 7, bounded=False), "expected actions from -1 to 1, which env accepts, got"),
    (two_inputs, "policy: expected a model with one input, got 2: observation, state"),
    (random_policy, "policy: expected the exported ONNX graph to give the policy's actions"),
    (lambda: onnx.ModelProto(), "policy: expected a valid ONNX model"),
    (lambda: linear_policy(20, 6, output_shape=["n", "m"]), "policy: expected actions of shape (200, 7), got (200, 6)"),
]


@pytest.mark.parametrize(("policy", "message"), POLICIES)
def test_invalid_policies_are_refused(policy: Callable[[], Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(faceoff.Error) as caught:
        faceoff.export(policy(), tmp_path / "agent", task="defend")
    assert message in str(caught.value)
    assert str(caught.value).startswith("policy: expected")
    assert list(tmp_path.iterdir()) == []


ENVIRONMENTS: list[tuple[Callable[[], Any], str]] = [
    (lambda: 3, "env: expected an environment of faceoff.gym or faceoff.sb3, with or without wrappers, got 3"),
    (lambda: Doubling(AirHockeyEnv()), "env: expected wrappers that can be exported, got Doubling: put what it does into"),
    (lambda: OwnEnv(), "env: expected an AirHockeyEnv, got OwnEnv with a step or reset of its own"),
    (
        lambda: wrappers.TransformObservation(AirHockeyEnv(), lambda values: values.clip(-1, 1), None),
        "env: expected wrappers that can be read, got TransformObservation with a function: put what it does into",
    ),
    (lambda: wrappers.FrameStackObservation(AirHockeyEnv(), 4), "got FrameStackObservation"),
    (lambda: wrappers.StickyAction(AirHockeyEnv(), 0.5), "got StickyAction"),
    (
        lambda: MalletPlane(wrappers.ClipAction(AirHockeyEnv(action_mode="raw", interpolation=3))),
        "env: expected no ClipAction below MalletPlane",
    ),
    (lambda: AsyncVectorEnv([AirHockeyEnv]), "env: expected worlds in this process, got an AsyncVectorEnv: pass env="),
]


@pytest.mark.parametrize(("make", "message"), ENVIRONMENTS)
def test_invalid_environments_are_refused(make: Callable[[], Any], message: str, tmp_path: Path) -> None:
    env = make()
    with pytest.raises(faceoff.Error) as caught:
        faceoff.export(MODEL, tmp_path / "agent", env=env)
    assert message in str(caught.value)
    assert list(tmp_path.iterdir()) == []
    if isinstance(env, AsyncVectorEnv):
        env.close()


def test_wrapper_without_a_step_of_its_own_is_skipped(tmp_path: Path) -> None:
    assert faceoff.export(MODEL, tmp_path / "agent", env=Annotated(AirHockeyEnv())).is_dir()


ARGUMENTS: list[tuple[dict[str, Any], str]] = [
    ({}, "env: expected the environment of the training, or task= for an environment with default arguments, got neither"),
    ({"task": "score"}, "task: expected one of hit, defend, prepare, got 'score'"),
    ({"task": 3}, "task: expected one of"),
    ({"task": "prepare", "env": AirHockeyEnv("defend")}, "task: expected defend, the task of env, got 'prepare'"),
    ({"task": "defend", "name": ""}, "name: expected 1 to 60 printable characters, got ''"),
    ({"task": "defend", "name": "a\nb"}, "name: expected 1 to 60 printable characters"),
    ({"task": "defend", "name": "a" * 61}, "name: expected 1 to 60 printable characters"),
    ({"task": "defend", "name": 7}, "name: expected text, got 7"),
    ({"task": "defend", "deterministic": False}, "deterministic: expected True"),
]


@pytest.mark.parametrize(("arguments", "message"), ARGUMENTS)
def test_invalid_arguments_are_refused(arguments: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(faceoff.Error) as caught:
        faceoff.export(MODEL, tmp_path / "agent", **arguments)
    assert message in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_existing_folder_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "agent").mkdir()
    (tmp_path / "link").symlink_to("nowhere")
    for name in ("agent", "link"):
        with pytest.raises(faceoff.ArgumentError, match="folder: expected a path that does not exist"):
            faceoff.export(MODEL, tmp_path / name, task="defend")
    with pytest.raises(faceoff.ArgumentError, match="folder: expected a path in an existing folder"):
        faceoff.export(MODEL, tmp_path / "none" / "agent", task="defend")
    with pytest.raises(faceoff.ArgumentTypeError, match="folder: expected the path of a folder to create, got 3"):
        faceoff.export(MODEL, 3, task="defend")  # type: ignore[arg-type]
    assert list((tmp_path / "agent").iterdir()) == []


def test_error_while_writing_leaves_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from faceoff._export import bundle

    monkeypatch.setattr(bundle, "PARTS", (*bundle.PARTS, "missing.py"))
    with pytest.raises(FileNotFoundError):
        faceoff.export(MODEL, tmp_path / "agent", task="defend")
    assert list(tmp_path.iterdir()) == []


def test_missing_onnx_error_has_the_install_command(tmp_path: Path) -> None:
    program = (
        "import sys; sys.modules['onnx'] = None\n"
        "import faceoff\n"
        "try:\n    faceoff.export('policy.onnx', sys.argv[1], task='defend')\n"
        "except faceoff.Error as error:\n    print(type(error).__name__, error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, tmp_path / "agent"], capture_output=True, text=True, check=True
    )
    assert done.stdout == "MissingError faceoff.export needs onnx: pip install 'faceoff-robotics[export]'\n"
