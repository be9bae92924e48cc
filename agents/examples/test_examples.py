"""Tests the examples: trained weights keep their scores and become an agent, and both trainings can be repeated."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt
import onnx
import pytest
from onnx.reference import ReferenceEvaluator

import clone_striker
import make_bundle
import train_ppo
from network import Floats, Network, Normalisation, SavedPolicy, save
from player import Player
from ppo import Learner, Settings
from scores import Hold, score
from view import FEATURE_COUNT, Puck

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
TARGET = Path(os.environ.get("TARGET_DIR", ROOT / "target"))
PROGRAM = Path(os.environ.get("FACEOFF_BIN", TARGET / "debug" / "faceoff"))
TRAINED = {"ppo": HERE / "trained" / "ppo" / "weights.npz", "clone": HERE / "trained" / "clone" / "weights.npz"}
#: Episodes for measuring a success rate.
EPISODES = 200
#: A configuration in which every answer is in time, however busy the machine is.
LONG_TIME_LIMITS = ROOT / "tests" / "long_time_limits.toml"


@pytest.fixture(scope="session")
def hold_success_percent() -> float:
    """Success rate of an arm that holds still, percent."""
    return 100.0 * float(score(Hold(), EPISODES)["success_rate"])


@pytest.mark.parametrize("name", TRAINED)
def test_trained_weights_beat_holding_by_30_percentage_points(name: str, hold_success_percent: float) -> None:
    scored = score(Player(SavedPolicy(TRAINED[name])), EPISODES)
    assert 100.0 * scored["success_rate"] >= hold_success_percent + 30.0
    assert scored["tier"] == "deployable"
    assert TRAINED[name].stat().st_size <= 1_000_000


@pytest.mark.parametrize("name", TRAINED)
def test_exported_network_equals_the_weights(name: str, tmp_path: Path) -> None:
    make_bundle.make(TRAINED[name], tmp_path / "agent")
    network = ReferenceEvaluator(onnx.load(tmp_path / "agent" / "policy.onnx"))
    policy = SavedPolicy(TRAINED[name])
    rng = np.random.default_rng(0)
    # Inputs like those in training, and far beyond: the exported network also clips.
    for spread in (1.0, 100.0):
        noise = spread * rng.standard_normal((50, FEATURE_COUNT))
        inputs = (policy.parts["mean"] + policy.parts["deviation"] * noise).astype(np.float32)
        (actions,) = network.run(["action"], {"view": inputs})
        np.testing.assert_allclose(np.asarray(actions), policy(inputs), rtol=1e-4, atol=1e-5)


def test_bundle_runs_in_the_sandbox_with_onnx_runtime(tmp_path: Path) -> None:
    make_bundle.make(TRAINED["ppo"], tmp_path / "learned")
    config = tmp_path / "faceoff.toml"
    # The folder is not always below the target folder: agents have no access to the host's /tmp.
    runtimes = subprocess.run([ROOT / "tests" / "runtimes.sh", TARGET], check=True, stdout=subprocess.PIPE, text=True)
    folder = Path(runtimes.stdout.rstrip("\n")) / "python3-ml"
    config.write_text(LONG_TIME_LIMITS.read_text() + f'[runtimes.python3-ml]\nfolder = "{folder}"\n')
    command: list[str | Path] = [PROGRAM, "eval", tmp_path / "learned", "--task", "defend", "--episodes", "20"]
    completed = subprocess.run(
        [*command, "--config", config, "--out", tmp_path / "result"], capture_output=True, text=True
    )
    assert completed.returncode == 0, completed.stderr + completed.stdout
    scored = json.loads((tmp_path / "result" / "results.json").read_text())["tasks"]["defend"]
    # ONNX Runtime rounds differently from NumPy: successes differ, but their number is similar.
    assert scored["successes"] >= 9, completed.stdout
    violations = {name: count for name, count in scored["violations"].items() if name != "computation_time"}
    assert not any(violations.values()), completed.stdout


def test_existing_folder_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "agent").mkdir()
    command: list[str | Path] = [sys.executable, HERE / "make_bundle.py", TRAINED["ppo"], tmp_path / "agent"]
    completed = subprocess.run(command, capture_output=True, text=True)
    assert completed.returncode == 1
    assert "exists already" in completed.stderr


class IdentityWorlds:
    """Worlds whose best action equals the features, with episodes of one step."""

    worlds = 64
    feature_count = 2
    actions = 2

    def reset(self, seed: int) -> Floats:
        self._rng = np.random.default_rng(seed)
        self.losses: list[float] = []
        return self._draw()

    def _draw(self) -> Floats:
        self._features = self._rng.uniform(-1.0, 1.0, (self.worlds, self.feature_count)).astype(np.float32)
        return self._features

    def step(self, actions: Floats) -> tuple[Floats, Floats, npt.NDArray[np.bool_]]:
        losses = ((actions - self._features) ** 2).sum(axis=1)
        self.losses.append(float(losses.mean()))
        return self._draw(), -losses, np.ones(self.worlds, np.bool_)


def test_ppo_minimises_the_loss_of_single_steps() -> None:
    worlds = IdentityWorlds()
    learner = Learner(worlds, Settings(minibatch=1024), seed=0)
    for round_number in range(60):
        learner.round(round_number / 60)
    # The loss of an untrained policy is the variance of two uniform variables, 2/3, plus its noise.
    assert np.mean(worlds.losses[:10]) > 0.6
    assert np.mean(worlds.losses[-10:]) < 0.05


def test_gradients_equal_difference_quotients() -> None:
    rng = np.random.default_rng(0)
    network = Network((3, 5, 2), rng, last_scale=1.0)
    inputs, targets = rng.standard_normal((2, 7, 3)), rng.standard_normal((7, 2))

    def loss() -> float:
        return float(0.5 * ((network(inputs[0]) - targets) ** 2).sum())

    # Float64, because difference quotients need the precision.
    network.weights = [weight.astype(np.float64) for weight in network.weights]
    network.biases = [bias.astype(np.float64) for bias in network.biases]
    layers = network.layers(inputs[0])
    gradients = network.gradients(layers, layers[-1] - targets)
    for parameter, gradient in zip(network.parameters(), gradients, strict=True):
        for index in np.ndindex(parameter.shape):
            original = parameter[index]
            parameter[index] = original + 1e-6
            loss_above = loss()
            parameter[index] = original - 1e-6
            loss_below = loss()
            parameter[index] = original
            assert math.isclose(gradient[index], (loss_above - loss_below) / 2e-6, rel_tol=1e-5, abs_tol=1e-6)


def test_saved_policy_equals_the_network(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    network, normalisation = Network((4, 8, 2), rng, last_scale=1.0), Normalisation(4)
    samples = (5.0 + 3.0 * rng.standard_normal((100, 4))).astype(np.float32)
    normalisation.update(samples[:60])
    normalisation.update(samples[60:])
    np.testing.assert_allclose(normalisation.mean, samples.mean(axis=0), rtol=1e-4)
    np.testing.assert_allclose(normalisation.variance, samples.var(axis=0), rtol=1e-3)
    save(tmp_path / "weights.npz", network, normalisation)
    np.testing.assert_allclose(
        SavedPolicy(tmp_path / "weights.npz")(samples), network(normalisation(samples)), rtol=1e-4, atol=1e-5
    )


def test_lost_puck_is_extrapolated() -> None:
    puck = Puck(2)
    puck.restart(np.ones(2, np.bool_))
    observation = np.zeros((2, 20))
    observation[:, :2], observation[:, 3:5] = (1.5, 0.1), (-1.0, 0.0)
    puck.observe(observation)
    observation[0, 3:5] = 0.0  # the first puck is lost: its old position, at rest
    observation[1, 0] = 1.48
    puck.observe(observation)
    np.testing.assert_allclose(puck.xy[:, 0], [1.48, 1.48], atol=1e-3)
    np.testing.assert_allclose(puck.speed[:, 0], [-1.0, -1.0], atol=0.02)
    np.testing.assert_allclose(puck.lost_s, [0.02, 0.0])


def test_short_training_writes_weights_and_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    arguments = ["--steps", "2000", "--worlds", "16", "--episodes", "3", "--out", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", ["train_ppo.py", *arguments])
    train_ppo.main()
    log = (tmp_path / "log.txt").read_text()
    assert "2,048 control steps" in log and "hold" in log
    assert SavedPolicy(tmp_path / "weights.npz").layers == 3


def test_short_recording_of_striker_is_imitated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bundle = tmp_path / "striker"
    bundle.mkdir()
    for part in (ROOT / "agents" / "striker" / "agent.toml", PROGRAM.parent / "striker"):
        shutil.copy(part, bundle)
    arguments = ["--bundle", bundle, "--program", PROGRAM, "--recorded", "12", "--episodes", "3"]
    arguments += ["--out", tmp_path / "out"]
    # `eval` reads the configuration in its working folder.
    shutil.copy(LONG_TIME_LIMITS, tmp_path / "faceoff.toml")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["clone_striker.py", *map(str, arguments)])
    clone_striker.main()
    log = (tmp_path / "out" / "log.txt").read_text().splitlines()
    errors = [float(line.split("off by ")[1].split()[0]) for line in log if "off by" in line]
    assert errors[-1] < errors[0], log
