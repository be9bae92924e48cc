"""Learns to defend by trying: PPO in NumPy, less than half an hour on two cores.

    python agents/examples/train_ppo.py --out my-training

Plays in the package's vector environment with the perturbations that count, each world with another robot, and writes
`weights.npz` and `log.txt`. Then it plays the episodes of `faceoff eval --seed 0`, which it did not learn in, beside an
arm that holds still. `make_bundle.py` makes an agent of the weights.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

# The environment has threads of its own; those of linear algebra, on arrays so small, only take CPUs from them.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from network import save
from ppo import Learner, Settings
from scores import tell
from worlds import Defending

STEPS = 20_000_000
#: Rounds between two lines of the log.
TOLD_EVERY = 50


def main() -> None:
    """Trains, writes, evaluates."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument("--steps", type=int, default=STEPS, help=f"control steps to learn from ({STEPS:,})")
    parser.add_argument("--worlds", type=int, default=256, help="played at once (256)")
    parser.add_argument("--seed", type=int, default=1, help="of everything drawn (1)")
    parser.add_argument("--episodes", type=int, default=400, help="of the evaluation at the end (400)")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    with (given.out / "log.txt").open("w") as log:

        def say(line: str) -> None:
            print(line, flush=True)
            log.write(line + "\n")

        say("$ python " + " ".join(sys.argv))
        worlds = train(given, say)
        say(f"{worlds:,} control steps learned from")
        tell(given.out / "weights.npz", given.episodes, say)


def train(given: argparse.Namespace, say: Callable[[str], None]) -> int:
    """Learns and writes the weights; how many control steps it took."""
    worlds = Defending(given.worlds)
    learner = Learner(worlds, Settings(), given.seed)
    per_round: int = learner.settings.steps_per_round * given.worlds
    rounds: int = -(-given.steps // per_round)
    begun = time.perf_counter()
    for done in range(1, rounds + 1):
        learner.round((done - 1) / rounds)
        if done % TOLD_EVERY == 0 or done == rounds:
            taken = time.perf_counter() - begun
            success, violated = worlds.shares()
            say(
                f"{taken:5.0f} s  {done * per_round:>12,} steps, {done * per_round / taken:,.0f}/s: {100.0 * success:.1f} % of "
                f"the episodes since the last line held, {100.0 * violated:.1f} % broke a constraint"
            )
    save(given.out / "weights.npz", learner.policy, learner.normalisation)
    return rounds * per_round


if __name__ == "__main__":
    main()
