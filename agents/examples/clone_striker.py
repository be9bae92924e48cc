"""Learns to defend by imitating `striker` in a recorded evaluation.

    make agents                                                       # the bundle of striker
    python agents/examples/clone_striker.py --out my-clone            # records, learns, evaluates

Records episodes with `faceoff eval`, reads them with `faceoff.dataset`, computes striker's mallet velocities, and fits
a network to them. Writes `weights.npz` and `log.txt`, then evaluates on the episodes of `faceoff eval --seed 0`, which
are not in the training data. With `--dataset` it learns from an existing recording, of any agent.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import faceoff.dataset
import numpy as np
import numpy.typing as npt
from faceoff import kinematics

from network import Adam, Floats, Network, Normalisation, save
from player import MAX_SPEED_M_S
from scores import log_scores
from view import DT_S, View

ROOT = Path(__file__).parents[2]
EPOCHS = 40
MINIBATCH = 2048
LEARNING_RATE = 2e-3
HIDDEN = (128, 128)
#: Share of the episodes for validation.
VALIDATION_SHARE = 0.1


def main() -> None:
    """Records, learns, writes, evaluates."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument("--dataset", type=Path, help="learn from this recording")
    bundle = ROOT / "target" / "bundles" / "striker"
    parser.add_argument("--bundle", type=Path, default=bundle, help="bundle of the agent to record")
    parser.add_argument("--program", type=Path, default=ROOT / "target" / "release" / "faceoff", help="faceoff")
    parser.add_argument("--recorded", type=int, default=2000, help="episodes to record (2000)")
    parser.add_argument("--seed", type=int, default=1, help="seed of all random draws and of the recording (1)")
    parser.add_argument("--episodes", type=int, default=400, help="episodes of the final evaluation (400)")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    with (arguments.out / "log.txt").open("w") as log:

        def log_line(line: str) -> None:
            print(line, flush=True)
            log.write(line + "\n")

        log_line("$ python " + " ".join(sys.argv))
        recording = arguments.dataset or record(arguments)
        features, velocities, episodes = read_recording(recording)
        log_line(f"{len(features):,} control steps of {len(np.unique(episodes))} episodes")
        fit(features, velocities, episodes, arguments.seed, arguments.out / "weights.npz", log_line)
        log_scores(arguments.out / "weights.npz", arguments.episodes, log_line)


def record(arguments: argparse.Namespace) -> Path:
    """Records an evaluation of the bundle; returns its output folder."""
    for needed, build in ((arguments.program, "cargo build --release"), (arguments.bundle, "make agents")):
        if not needed.exists():
            sys.exit(f"{needed} does not exist: run {build}, or name another")
    folder: Path = arguments.out / "recording"
    subprocess.run(
        [arguments.program, "eval", arguments.bundle, "--task", "defend", "--episodes", str(arguments.recorded)]
        + ["--seed", str(arguments.seed), "--workers", "2", "--out", folder],
        check=True,
    )
    return folder


def read_recording(recording: Path) -> tuple[Floats, Floats, npt.NDArray[np.int64]]:
    """The features, striker's mallet velocities (as shares of MAX_SPEED_M_S) and episode numbers of all steps.

    The episodes are processed together, as if each were a world, because features depend on earlier observations.
    """
    dataset = faceoff.dataset.open_dataset(recording)
    # Failed episodes are not imitated.
    recorded = [episode.to_numpy() for episode in dataset.episodes("defend") if episode.success]
    if len(recorded) < 2:
        sys.exit(f"{recording}: expected at least two successful episodes of defend, got {len(recorded)}")
    lengths = np.array([len(episode.actions) for episode in recorded])
    longest = lengths.max()
    observations = np.stack([padded(episode.observations[:-1], longest) for episode in recorded])
    commanded = [kinematics.forward(episode.actions[:, 0])[:, :2] for episode in recorded]
    start = kinematics.forward(kinematics.model.START_Q)[:2]
    mallets = np.stack([padded(np.vstack([start, path]), longest + 1) for path in commanded])
    speeds = np.diff(mallets, axis=1) / DT_S
    view = View(len(recorded))
    last_speeds = np.zeros((len(recorded), 2))
    feature_rows, velocities, episode_numbers = [], [], []
    for step in range(longest):
        features = view.update(observations[:, step], mallets[:, step], last_speeds)
        last_speeds = speeds[:, step]
        running = np.flatnonzero(step < lengths)
        feature_rows.append(features[running])
        velocities.append(last_speeds[running] / MAX_SPEED_M_S)
        episode_numbers.append(running)
    return (
        np.concatenate(feature_rows).astype(np.float32),
        np.concatenate(velocities).astype(np.float32),
        np.concatenate(episode_numbers),
    )


def padded(rows: npt.NDArray[np.float64], length: int) -> npt.NDArray[np.float64]:
    """The rows, with the last one repeated up to `length`."""
    return np.concatenate([rows, np.repeat(rows[-1:], length - len(rows), axis=0)])


def fit(
    features: Floats,
    velocities: Floats,
    episodes: npt.NDArray[np.int64],
    seed: int,
    weights: Path,
    log_line: Callable[[str], None],
) -> None:
    """Fits a network to the mallet velocities by least squares, and saves it."""
    rng = np.random.default_rng(seed)
    normalisation = Normalisation(features.shape[1])
    normalisation.update(features)
    inputs = normalisation(features)
    shuffled = rng.permutation(episodes.max() + 1)
    is_validation = np.isin(episodes, shuffled[: max(1, int(VALIDATION_SHARE * len(shuffled)))])
    training = np.flatnonzero(~is_validation)
    network = Network((features.shape[1], *HIDDEN, velocities.shape[1]), rng, last_scale=0.1)
    adam = Adam(network.parameters(), max_norm=1.0)
    started_s = time.perf_counter()
    for epoch in range(EPOCHS):
        rng.shuffle(training)
        for start in range(0, len(training), MINIBATCH):
            batch = training[start : start + MINIBATCH]
            layers = network.layers(inputs[batch])
            adam.step(
                network.gradients(layers, (layers[-1] - velocities[batch]) / np.float32(len(batch))),
                LEARNING_RATE * (1.0 - epoch / EPOCHS),
            )
        if epoch % 5 == 4:
            errors = [
                MAX_SPEED_M_S * float(np.sqrt(np.mean((network(inputs[part]) - velocities[part]) ** 2)))
                for part in (training, np.flatnonzero(is_validation))
            ]
            log_line(
                f"{time.perf_counter() - started_s:5.0f} s  epoch {epoch + 1:3}: off by {errors[0]:.3f} m/s, "
                f"{errors[1]:.3f} m/s in validation episodes"
            )
    save(weights, network, normalisation)


if __name__ == "__main__":
    main()
