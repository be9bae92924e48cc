"""The examples: what was trained still plays as its log tells, becomes an agent, and can be learned again."""

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
from network import Floats, Network, Normalisation, Saved, save
from player import Player
from ppo import Learner, Settings
from scores import Hold, score
from view import LENGTH, Puck

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
TARGET = Path(os.environ.get("TARGET_DIR", ROOT / "target"))
PROGRAM = Path(os.environ.get("FACEOFF_BIN", TARGET / "debug" / "faceoff"))
TRAINED = {"ppo": HERE / "trained" / "ppo" / "weights.npz", "clone": HERE / "trained" / "clone" / "weights.npz"}
EPISODES = 200
#: Time for every answer, however busy the machine is.
PATIENT = ROOT / "tests" / "patient.toml"


@pytest.fixture(scope="session")
def hold() -> float:
    """How often an arm that holds still defends, percent."""
    return 100.0 * float(score(Hold(), EPISODES)["success_rate"])


@pytest.mark.parametrize("name", TRAINED)
def test_trained_weights_defend_30_points_more_often_than_an_arm_that_holds(name: str, hold: float) -> None:
    scored = score(Player(Saved(TRAINED[name])), EPISODES)
    assert 100.0 * scored["success_rate"] >= hold + 30.0
    assert scored["tier"] == "deployable"
    assert TRAINED[name].stat().st_size <= 1_000_000


@pytest.mark.parametrize("name", TRAINED)
def test_the_exported_network_answers_as_the_weights_do(name: str, tmp_path: Path) -> None:
    make_bundle.make(TRAINED[name], tmp_path / "agent")
    network = ReferenceEvaluator(onnx.load(tmp_path / "agent" / "policy.onnx"))
    policy = Saved(TRAINED[name])
    draws = np.random.default_rng(0)
    # Within what it saw, and far beyond: the normalisation's bounds are in the file, too.
    for spread in (1.0, 100.0):
        noise = spread * draws.standard_normal((50, LENGTH))
        seen = (policy.parts["mean"] + policy.parts["deviation"] * noise).astype(np.float32)
        (answered,) = network.run(["action"], {"seen": seen})
        np.testing.assert_allclose(np.asarray(answered), policy(seen), rtol=1e-4, atol=1e-5)


def test_the_bundle_plays_in_the_sandbox_with_onnx_runtime(tmp_path: Path) -> None:
    make_bundle.make(TRAINED["ppo"], tmp_path / "learned")
    config = tmp_path / "faceoff.toml"
    # Not always below the target folder: agents see nothing of the host's /tmp.
    told = subprocess.run([ROOT / "tests" / "runtimes.sh", TARGET], check=True, stdout=subprocess.PIPE, text=True)
    folder = Path(told.stdout.rstrip("\n")) / "python3-ml"
    config.write_text(PATIENT.read_text() + f'[runtimes.python3-ml]\nfolder = "{folder}"\n')
    command: list[str | Path] = [PROGRAM, "eval", tmp_path / "learned", "--task", "defend", "--episodes", "20"]
    done = subprocess.run(
        [*command, "--config", config, "--out", tmp_path / "result"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr + done.stdout
    scored = json.loads((tmp_path / "result" / "results.json").read_text())["tasks"]["defend"]
    # ONNX Runtime rounds otherwise than NumPy: not the same episodes, but about as many.
    assert scored["successes"] >= 9, done.stdout
    broken = {name: count for name, count in scored["violations"].items() if name != "computation_time"}
    assert not any(broken.values()), done.stdout


def test_what_is_there_already_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "agent").mkdir()
    command: list[str | Path] = [sys.executable, HERE / "make_bundle.py", TRAINED["ppo"], tmp_path / "agent"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1
    assert "is there already" in done.stderr


class Guessing:
    """Worlds where the best action is what is seen, and every step is an episode."""

    worlds = 64
    view_length = 2
    actions = 2

    def reset(self, seed: int) -> Floats:
        self._draws = np.random.default_rng(seed)
        self.losses: list[float] = []
        return self._draw()

    def _draw(self) -> Floats:
        self._now = self._draws.uniform(-1.0, 1.0, (self.worlds, self.view_length)).astype(np.float32)
        return self._now

    def step(self, actions: Floats) -> tuple[Floats, Floats, npt.NDArray[np.bool_]]:
        losses = ((actions - self._now) ** 2).sum(axis=1)
        self.losses.append(float(losses.mean()))
        return self._draw(), -losses, np.ones(self.worlds, np.bool_)


def test_ppo_learns_what_a_step_is_worth() -> None:
    worlds = Guessing()
    learner = Learner(worlds, Settings(minibatch=1024), seed=0)
    for done in range(60):
        learner.round(done / 60)
    # An untrained one is off by two uniform variables' variance, 2/3, and its own noise.
    assert np.mean(worlds.losses[:10]) > 0.6
    assert np.mean(worlds.losses[-10:]) < 0.05


def test_gradients_are_those_of_the_loss() -> None:
    draws = np.random.default_rng(0)
    network = Network((3, 5, 2), draws, last_scale=1.0)
    seen, wanted = draws.standard_normal((2, 7, 3)), draws.standard_normal((7, 2))

    def loss() -> float:
        return float(0.5 * ((network(seen[0]) - wanted) ** 2).sum())

    # In doubles, whose differences tell a gradient.
    network.weights = [one.astype(np.float64) for one in network.weights]
    network.biases = [one.astype(np.float64) for one in network.biases]
    layers = network.layers(seen[0])
    told = network.gradients(layers, layers[-1] - wanted)
    for parameter, gradient in zip(network.parameters(), told, strict=True):
        for place in np.ndindex(parameter.shape):
            before = parameter[place]
            parameter[place] = before + 1e-6
            above = loss()
            parameter[place] = before - 1e-6
            below = loss()
            parameter[place] = before
            assert math.isclose(gradient[place], (above - below) / 2e-6, rel_tol=1e-5, abs_tol=1e-6)


def test_a_saved_policy_answers_as_before(tmp_path: Path) -> None:
    draws = np.random.default_rng(0)
    network, normalisation = Network((4, 8, 2), draws, last_scale=1.0), Normalisation(4)
    seen = (5.0 + 3.0 * draws.standard_normal((100, 4))).astype(np.float32)
    normalisation.see(seen[:60])
    normalisation.see(seen[60:])
    np.testing.assert_allclose(normalisation.mean, seen.mean(axis=0), rtol=1e-4)
    np.testing.assert_allclose(normalisation.variance, seen.var(axis=0), rtol=1e-3)
    save(tmp_path / "weights.npz", network, normalisation)
    np.testing.assert_allclose(
        Saved(tmp_path / "weights.npz")(seen), network(normalisation(seen)), rtol=1e-4, atol=1e-5
    )


def test_a_lost_puck_is_followed_on_its_way() -> None:
    puck = Puck(2)
    puck.restart(np.ones(2, np.bool_))
    observation = np.zeros((2, 20))
    observation[:, :2], observation[:, 3:5] = (1.5, 0.1), (-1.0, 0.0)
    puck.observe(observation)
    observation[0, 3:5] = 0.0  # the first one is lost: the old place, at rest
    observation[1, 0] = 1.48
    puck.observe(observation)
    np.testing.assert_allclose(puck.xy[:, 0], [1.48, 1.48], atol=1e-3)
    np.testing.assert_allclose(puck.speed[:, 0], [-1.0, -1.0], atol=0.02)
    np.testing.assert_allclose(puck.lost_s, [0.02, 0.0])


def test_a_short_training_writes_weights_and_a_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    arguments = ["--steps", "2000", "--worlds", "16", "--episodes", "3", "--out", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", ["train_ppo.py", *arguments])
    train_ppo.main()
    told = (tmp_path / "log.txt").read_text()
    assert "2,048 control steps" in told and "hold" in told
    assert Saved(tmp_path / "weights.npz").layers == 3


def test_a_short_recording_of_striker_is_cloned(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bundle = tmp_path / "striker"
    bundle.mkdir()
    for part in (ROOT / "agents" / "striker" / "agent.toml", PROGRAM.parent / "striker"):
        shutil.copy(part, bundle)
    arguments = ["--bundle", bundle, "--program", PROGRAM, "--recorded", "12", "--episodes", "3", "--out", tmp_path / "out"]
    # `eval` reads it from where it is.
    shutil.copy(PATIENT, tmp_path / "faceoff.toml")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["clone_striker.py", *map(str, arguments)])
    clone_striker.main()
    told = (tmp_path / "out" / "log.txt").read_text().splitlines()
    off = [float(line.split("off by ")[1].split()[0]) for line in told if "off by" in line]
    assert off[-1] < off[0], told
