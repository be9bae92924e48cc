"""Learns to defend by reinforcement: proximal policy optimisation (PPO) in NumPy, less than half an hour on two cores.

    python agents/examples/train_ppo.py --out my-training

Trains in the package's vector environment with the perturbations of evaluations, and writes `weights.npz` and `log.txt`. Then it evaluates on the episodes of `faceoff eval --seed 0`,
which are not used for training, and compares with an arm that holds still. `make_bundle.py` makes an agent of the weights.

Each world (simulated table) has another robot. The season's robot is known from your first dataset on: train with it
by `--dataset dataset.zip`.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

# The environment has its own threads; threads of linear algebra on small arrays would only compete with them.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import faceoff.dataset
from network import save
from ppo import Learner, Settings
from scores import log_scores
from worlds import DefendWorlds

STEPS = 20_000_000
#: Rounds between two lines of the log.
ROUNDS_PER_LOG_LINE = 50


def main() -> None:
    """Trains a policy, saves its weights and evaluates it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument("--steps", type=int, default=STEPS, help=f"control steps to learn from ({STEPS:,})")
    parser.add_argument("--worlds", type=int, default=256, help="worlds stepped together (256)")
    parser.add_argument("--seed", type=int, default=1, help="seed of all random draws (1)")
    parser.add_argument("--dataset", type=Path, help="a dataset of the season, whose robot to train with")
    parser.add_argument("--episodes", type=int, default=400, help="episodes of the final evaluation (400)")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    with (arguments.out / "log.txt").open("w") as log:

        def log_line(line: str) -> None:
            print(line, flush=True)
            log.write(line + "\n")

        log_line("$ python " + " ".join(sys.argv))
        steps = train(arguments, log_line)
        log_line(f"{steps:,} control steps learned from")
        log_scores(arguments.out / "weights.npz", arguments.episodes, log_line)


def train(arguments: argparse.Namespace, log_line: Callable[[str], None]) -> int:
    """Trains and saves the weights; returns the number of control steps."""
    mismatch_seed = None if arguments.dataset is None else faceoff.dataset.open(arguments.dataset).mismatch_seed
    worlds = DefendWorlds(arguments.worlds, mismatch_seed)
    learner = Learner(worlds, Settings(), arguments.seed)
    steps_per_round: int = learner.settings.steps_per_round * arguments.worlds
    rounds: int = -(-arguments.steps // steps_per_round)
    started_s = time.perf_counter()
    for round_number in range(1, rounds + 1):
        learner.round((round_number - 1) / rounds)
        if round_number % ROUNDS_PER_LOG_LINE == 0 or round_number == rounds:
            steps = round_number * steps_per_round
            elapsed_s = time.perf_counter() - started_s
            succeeded, violated = worlds.shares()
            log_line(
                f"{elapsed_s:5.0f} s  {steps:>12,} steps, {steps / elapsed_s:,.0f}/s: "
                f"{100.0 * succeeded:.1f} % of the episodes since the last line succeeded, "
                f"{100.0 * violated:.1f} % violated a constraint"
            )
    save(arguments.out / "weights.npz", learner.policy, learner.normalisation)
    return rounds * steps_per_round


if __name__ == "__main__":
    main()
