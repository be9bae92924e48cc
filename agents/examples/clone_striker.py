"""Learns to defend by example: what `striker` did in a recorded evaluation.

    make agents                                                       # the bundle of striker
    python agents/examples/clone_striker.py --out my-clone            # records, learns, evaluates

Records episodes with `faceoff eval`, reads them with `faceoff.dataset`, works out where striker moved its mallet, and
fits a network to it. Writes `weights.npz` and `log.txt`, then plays the episodes of `faceoff eval --seed 0`, which it did
not learn from. With `--dataset` it learns from a recording that is there already: of another agent, or the one that the
server gives you of your own.
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
from scores import tell
from view import DT_S, View

ROOT = Path(__file__).parents[2]
EPOCHS = 40
MINIBATCH = 2048
RATE = 2e-3
HIDDEN = (128, 128)
#: Share of the episodes that are kept apart, to see whether what was learned holds for others.
KEPT_APART = 0.1


def main() -> None:
    """Records, learns, writes, evaluates."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument("--dataset", type=Path, help="learn from this recording")
    parser.add_argument("--bundle", type=Path, default=ROOT / "target" / "bundles" / "striker", help="whom to record")
    parser.add_argument("--program", type=Path, default=ROOT / "target" / "release" / "faceoff", help="faceoff")
    parser.add_argument("--recorded", type=int, default=2000, help="episodes to record (2000)")
    parser.add_argument("--seed", type=int, default=1, help="of everything drawn, and of the recording (1)")
    parser.add_argument("--episodes", type=int, default=400, help="of the evaluation at the end (400)")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    with (given.out / "log.txt").open("w") as log:

        def say(line: str) -> None:
            print(line, flush=True)
            log.write(line + "\n")

        say("$ python " + " ".join(sys.argv))
        recording = given.dataset or record(given)
        views, moves, episodes = read(recording)
        say(f"{len(views):,} control steps of {len(np.unique(episodes))} episodes")
        learn(views, moves, episodes, given.seed, given.out / "weights.npz", say)
        tell(given.out / "weights.npz", given.episodes, say)


def record(given: argparse.Namespace) -> Path:
    """An evaluation of the bundle; the folder that it wrote."""
    for needed, made_by in ((given.program, "cargo build --release"), (given.bundle, "make agents")):
        if not needed.exists():
            sys.exit(f"{needed} is not there: {made_by}, or name another")
    folder: Path = given.out / "recording"
    subprocess.run(
        [given.program, "eval", given.bundle, "--task", "defend", "--episodes", str(given.recorded)]
        + ["--seed", str(given.seed), "--workers", "2", "--out", folder],
        check=True,
    )
    return folder


def read(recording: Path) -> tuple[Floats, Floats, npt.NDArray[np.int64]]:
    """Of each step what a policy would have seen, how the mallet then moved, and of which episode it is.

    Episodes are gone through side by side, as if they were worlds: a view remembers what it saw before.
    """
    dataset = faceoff.dataset.open_dataset(recording)
    # Who failed is no example.
    told = [episode.to_numpy() for episode in dataset.episodes("defend") if episode.success]
    if len(told) < 2:
        sys.exit(f"{recording}: expected episodes of defend that were held, two at least, got {len(told)}")
    lengths = np.array([len(one.actions) for one in told])
    longest = lengths.max()
    observations = np.stack([padded(one.observations[:-1], longest) for one in told])
    commanded = [kinematics.forward(one.actions[:, 0])[:, :2] for one in told]
    start = kinematics.forward(kinematics.model.START_Q)[:2]
    mallets = np.stack([padded(np.vstack([start, one]), longest + 1) for one in commanded])
    speeds = np.diff(mallets, axis=1) / DT_S
    view = View(len(told))
    before = np.zeros((len(told), 2))
    views, moves, of_episode = [], [], []
    for step in range(longest):
        seen = view.look(observations[:, step], mallets[:, step], before)
        before = speeds[:, step]
        under_way = np.flatnonzero(step < lengths)
        views.append(seen[under_way])
        moves.append(before[under_way] / MAX_SPEED_M_S)
        of_episode.append(under_way)
    return (
        np.concatenate(views).astype(np.float32),
        np.concatenate(moves).astype(np.float32),
        np.concatenate(of_episode),
    )


def padded(rows: npt.NDArray[np.float64], length: int) -> npt.NDArray[np.float64]:
    """The last row again and again, up to a length."""
    return np.concatenate([rows, np.repeat(rows[-1:], length - len(rows), axis=0)])


def learn(
    views: Floats,
    moves: Floats,
    episodes: npt.NDArray[np.int64],
    seed: int,
    weights: Path,
    say: Callable[[str], None],
) -> None:
    """Fits a network to the moves by least squares, and writes it."""
    rng = np.random.default_rng(seed)
    normalisation = Normalisation(views.shape[1])
    normalisation.see(views)
    seen = normalisation(views)
    drawn = rng.permutation(episodes.max() + 1)
    is_apart = np.isin(episodes, drawn[: max(1, int(KEPT_APART * len(drawn)))])
    taught = np.flatnonzero(~is_apart)
    network = Network((views.shape[1], *HIDDEN, moves.shape[1]), rng, last_scale=0.1)
    adam = Adam(network.parameters(), max_norm=1.0)
    begun = time.perf_counter()
    for epoch in range(EPOCHS):
        rng.shuffle(taught)
        for first in range(0, len(taught), MINIBATCH):
            some = taught[first : first + MINIBATCH]
            layers = network.layers(seen[some])
            adam.step(
                network.gradients(layers, (layers[-1] - moves[some]) / np.float32(len(some))),
                RATE * (1.0 - epoch / EPOCHS),
            )
        if epoch % 5 == 4:
            errors = [
                MAX_SPEED_M_S * float(np.sqrt(np.mean((network(seen[part]) - moves[part]) ** 2)))
                for part in (taught, np.flatnonzero(is_apart))
            ]
            say(
                f"{time.perf_counter() - begun:5.0f} s  epoch {epoch + 1:3}: off by {errors[0]:.3f} m/s, "
                f"{errors[1]:.3f} m/s in episodes kept apart"
            )
    save(weights, network, normalisation)


if __name__ == "__main__":
    main()
