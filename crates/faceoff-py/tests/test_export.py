"""`faceoff.export` makes bundles of policies; here of ONNX models, which need no torch. Others: `tests_learning`."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import onnx
import pytest
from gymnasium import wrappers
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import vector as vector_wrappers
from onnx.reference import ReferenceEvaluator

import faceoff
import faceoff.gym
from faceoff.actions import environment_observation
from faceoff.gym import AirHockeyEnv, AirHockeyVectorEnv, MalletPlane, MalletPlaneVector
from faceoff.kinematics import MalletMotion, native
from faceoff.sb3 import VecEnvMethods
from onnx_policies import function_of, linear_policy
from program import PROGRAM, REPOSITORY

TARGET = Path(os.environ.get("TARGET_DIR", REPOSITORY / "target"))


def graph_of(folder: Path) -> Any:
    """The policy of a bundle in the reference evaluator: (length,) to (length,)."""
    evaluator: Any = ReferenceEvaluator(onnx.load(folder / "policy.onnx"))
    return lambda observation: evaluator.run(["action"], {"observation": np.asarray(observation, np.float32)[None]})[0][0]


def observations(env: Any) -> Any:
    return np.random.default_rng(3).uniform(env.observation_space.low, env.observation_space.high, (50, 20))


def test_bundle_has_manifest_agent_graph_and_package(tmp_path: Path) -> None:
    folder = faceoff.export(linear_policy(20, 7), tmp_path / "linear", task="defend")
    assert folder == tmp_path / "linear"
    files = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    package = {f"faceoff/{name}" for name in ("__init__.py", "errors.py", "agent.py", "actions.py")}
    assert files == {"agent.toml", "agent.py", "policy.onnx", *package}
    manifest = tomllib.loads((folder / "agent.toml").read_text())
    assert manifest == {
        "name": "linear", "command": ["python3", "agent.py"], "runtime": "python3-ml", "interpolation": 1,
    }
    assert folder.stat().st_mode & 0o777 == 0o755
    assert [path.name for path in tmp_path.iterdir()] == ["linear"]


def test_name_is_quoted_in_the_manifest(tmp_path: Path) -> None:
    name = 'Größe "7" \\ é'
    folder = faceoff.export(linear_policy(20, 420), tmp_path / "a", env=AirHockeyEnv(interpolation=None), name=name)
    manifest = tomllib.loads((folder / "agent.toml").read_text())
    assert manifest["name"] == name
    assert "interpolation" not in manifest


def test_models_are_accepted_as_object_and_as_path(tmp_path: Path) -> None:
    model = linear_policy(20, 14)
    onnx.save(model, tmp_path / "model.onnx")
    env = AirHockeyEnv("prepare", interpolation=3, action_mode="absolute")
    first = faceoff.export(model, tmp_path / "one", env=env, name="x")
    second = faceoff.export(str(tmp_path / "model.onnx"), tmp_path / "two", env=env, name="x")
    assert (first / "policy.onnx").read_bytes() == (second / "policy.onnx").read_bytes()
    own, exported = function_of(model), graph_of(first)
    for observation in observations(env):
        np.testing.assert_allclose(exported(observation), own(observation), atol=1e-6)


def with_all_wrappers(env: Any) -> Any:
    """An environment with each wrapper that can be exported, after some steps."""
    env = wrappers.RecordEpisodeStatistics(env)
    env = wrappers.ClipAction(wrappers.RescaleAction(wrappers.FlattenObservation(env), -3.0, 2.0))
    env = wrappers.NormalizeReward(wrappers.NormalizeObservation(env))
    env.reset(seed=0)
    draws = np.random.default_rng(0)
    for _ in range(100):
        *_, terminated, truncated, _ = env.step(draws.normal(0.0, 2.0, 7).astype(np.float32))
        if terminated or truncated:
            env.reset()
    return env


def test_wrappers_are_part_of_the_graph(tmp_path: Path) -> None:
    """The wrappers themselves give the expected action."""
    env = with_all_wrappers(gymnasium.make("faceoff/AirHockey-Defend-v0"))
    model = linear_policy(20, 7, scale=0.5, bounded=False)
    exported = graph_of(faceoff.export(model, tmp_path / "agent", env=env))
    normaliser = env.env
    normaliser.update_running_mean = False
    clip = normaliser.env
    act = function_of(model)
    for observation in observations(AirHockeyEnv()).astype(np.float32):
        action = act(normaliser.observation(observation))
        expected = clip.env.action(clip.action(action))
        np.testing.assert_allclose(exported(observation), expected, atol=1e-5)


def test_worlds_give_the_settings_of_a_single_environment(tmp_path: Path) -> None:
    arguments: dict[str, Any] = {"interpolation": 5, "action_mode": "absolute", "clip_actions": True}
    single = AirHockeyEnv("prepare", **arguments)
    many = {
        "vector": AirHockeyVectorEnv(3, "prepare", **arguments),
        "sb3": VecEnvMethods(AirHockeyVectorEnv(2, "prepare", autoreset_mode="SameStep", **arguments)),
        "clip": vector_wrappers.ClipAction(
            vector_wrappers.RecordEpisodeStatistics(AirHockeyVectorEnv(3, "prepare", **arguments))
        ),
        "sync": SyncVectorEnv([lambda: AirHockeyEnv("prepare", **arguments)] * 2, autoreset_mode=AutoresetMode.SAME_STEP),
    }
    model = linear_policy(20, 21)
    expected = (faceoff.export(model, tmp_path / "single", env=single) / "agent.py").read_text()
    for line in (
        'TASK: str = "prepare"', 'ACTION_MODE: str = "absolute"', "INTERPOLATION: int | None = 5",
        "CLIP_ACTIONS: bool = True", "MALLET_SPEED_M_S: float | None = None",
    ):
        assert line in expected.splitlines()
    for name, env in many.items():
        assert (faceoff.export(model, tmp_path / name, env=env) / "agent.py").read_text() == expected


def test_mallet_bundle_contains_the_compiled_inverse(tmp_path: Path) -> None:
    for name, env in {
        "one": MalletPlane(AirHockeyEnv(action_mode="raw", interpolation=3), 1.5),
        "many": MalletPlaneVector(AirHockeyVectorEnv(2, action_mode="raw", interpolation=3), 1.5),
    }.items():
        folder = faceoff.export(linear_policy(20, 2), tmp_path / name, env=env)
        assert "MALLET_SPEED_M_S: float | None = 1.5" in (folder / "agent.py").read_text()
        assert (folder / "faceoff" / "_native.abi3.so").is_file()
        assert (folder / "faceoff" / "kinematics" / "native.py").is_file()
        # Nothing of the bundle needs the rest of the package.
        program = "import faceoff; from faceoff.kinematics import native; print(faceoff.__file__, native.inverse([0.8, 0.1])[1])"
        done = subprocess.run([sys.executable, "-c", program], cwd=folder, capture_output=True, text=True, check=True)
        assert done.stdout == f"{folder}/faceoff/__init__.py True\n"


class JointPolicy:
    """A policy of `linear_policy` for `faceoff.evaluate`, from the environment's observation to its action."""

    def __init__(self, model: onnx.ModelProto) -> None:
        self.act = function_of(model)

    def __call__(self, observation: Any) -> Any:
        return self.act(environment_observation(observation)).astype(np.float64)


class MalletPolicy(JointPolicy):
    """The same for mallet velocities."""

    def __init__(self, model: onnx.ModelProto) -> None:
        super().__init__(model)
        self.motion = MalletMotion(1, 1.5, native.inverse)

    def reset(self, task: str, episode: int) -> None:
        self.motion.restart(np.ones(1, np.bool_))

    def __call__(self, observation: Any) -> Any:
        return self.motion.command(super().__call__(observation)[None])[0]


def runtime_config(folder: Path) -> Path:
    """A configuration with the runtime python3-ml, and with long time limits."""
    made = subprocess.run(
        [REPOSITORY / "tests" / "runtimes.sh", TARGET], check=True, stdout=subprocess.PIPE, text=True
    )
    config = folder / "faceoff.toml"
    runtime = Path(made.stdout.rstrip("\n")) / "python3-ml"
    limits = (REPOSITORY / "tests" / "long_time_limits.toml").read_text()
    config.write_text(f'{limits}[runtimes.python3-ml]\nfolder = "{runtime}"\n')
    return config


@pytest.mark.parametrize("kind", ["joints", "mallet"])
def test_program_scores_the_agent_like_the_policy(kind: str, tmp_path: Path) -> None:
    env: Any
    if kind == "joints":
        model, arguments = linear_policy(20, 7, scale=0.1), {"interpolation": 1, "action_mode": "delta"}
        env, policy = AirHockeyEnv("defend"), JointPolicy(model)
    else:
        model, arguments = linear_policy(20, 2), {"interpolation": 3, "action_mode": "raw"}
        env, policy = MalletPlane(AirHockeyEnv("defend", interpolation=3, action_mode="raw"), 1.5), MalletPolicy(model)
    folder = faceoff.export(model, tmp_path / "agent", env=env)
    command = [PROGRAM, "eval", folder, "--task", "defend", "--task", "prepare", "--episodes", "10", "--json", "--config"]
    done = subprocess.run(
        [*command, runtime_config(tmp_path), "--out", tmp_path / "out"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr + done.stdout
    answer = json.loads(done.stdout)
    assert answer["faults"] == []
    # In the task for which there is no policy the arm holds still.
    assert not any(v for k, v in answer["result"]["tasks"]["prepare"]["violations"].items() if k != "computation_time")
    played = answer["result"]["tasks"]["defend"]
    expected = faceoff.evaluate(policy, tasks="defend", episodes=10, **arguments)["tasks"]["defend"]  # type: ignore[arg-type]
    for result in (played, expected):
        result["violations"].pop("computation_time", None)
    # NumPy rounds differently from ONNX Runtime, which a bounce of the puck may amplify.
    assert abs(played["successes"] - expected["successes"]) <= 1
    assert played["violations"] == expected["violations"]
