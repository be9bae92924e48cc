"""Learns to defend by reinforcement: PPO in NumPy, less than half an hour on two cores.

    python agents/examples/train_ppo.py --out my-training

Trains in the package's vector environment with the perturbations of evaluations, each world with another robot, and
writes `weights.npz` and `log.txt`. Then it evaluates on the episodes of `faceoff eval --seed 0`, which are not used for
training, and compares with an arm that holds still. `make_bundle.py` makes an agent of the weights.
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

from network import save
from ppo import Learner, Settings
from scores import log_scores
from worlds import DefendWorlds

STEPS = 20_000_000
#: Rounds between two lines of the log.
LOG_EVERY = 50


def main() -> None:
    """Trains a policy, saves its weights and evaluates it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument("--steps", type=int, default=STEPS, help=f"control steps to learn from ({STEPS:,})")
    parser.add_argument("--worlds", type=int, default=256, help="worlds stepped together (256)")
    parser.add_argument("--seed", type=int, default=1, help="seed of all random draws (1)")
    parser.add_argument("--episodes", type=int, default=400, help="episodes of the final evaluation (400)")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    with (arguments.out / "log.txt").open("w") as log:

        def log_line(line: str) -> None:
            print(line, flush=True)
            log.write(line + "\n")

        log_line("$ python " + " ".join(sys.argv))
        worlds = train(arguments, log_line)
        log_line(f"{worlds:,} control steps learned from")
        log_scores(arguments.out / "weights.npz", arguments.episodes, log_line)


def train(arguments: argparse.Namespace, log_line: Callable[[str], None]) -> int:
    """Trains and saves the weights; returns the number of control steps."""
    worlds = DefendWorlds(arguments.worlds)
    learner = Learner(worlds, Settings(), arguments.seed)
    per_round: int = learner.settings.steps_per_round * arguments.worlds
    rounds: int = -(-arguments.steps // per_round)
    started_s = time.perf_counter()
    for done in range(1, rounds + 1):
        learner.round((done - 1) / rounds)
        if done % LOG_EVERY == 0 or done == rounds:
            elapsed_s = time.perf_counter() - started_s
            success, violated = worlds.shares()
            log_line(
                f"{elapsed_s:5.0f} s  {done * per_round:>12,} steps, {done * per_round / elapsed_s:,.0f}/s: "
                f"{100.0 * success:.1f} % of the episodes since the last line held, "
                f"{100.0 * violated:.1f} % broke a constraint"
            )
    save(arguments.out / "weights.npz", learner.policy, learner.normalisation)
    return rounds * per_round


if __name__ == "__main__":
    main()
