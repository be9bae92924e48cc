"""Control steps per second of the Python environments, beside the simulator's own batch in the same run.

    python crates/faceoff-py/benches/throughput.py [--worlds 256] [--threads 2] [--seconds 3] [--task prepare]

Arms are held (actions of 0). A control step is 20 physics steps. What is timed takes turns, so that a busy machine
slows all down alike; the median of the turns is told.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable

import numpy as np

from faceoff import _native
from faceoff.gym import AirHockeyEnv, AirHockeyVectorEnv

TURNS = 7


def main() -> None:
    """Times all and prints a table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--worlds", type=int, default=256)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--task", default="prepare")
    given = parser.parse_args()
    rows = {
        "one world, Python": (1, one(given.task)),
        "vector environment, copy": (given.worlds, many(given, copy=True)),
        "vector environment, no copy": (given.worlds, many(given, copy=False)),
        "vector environment, send/recv": (given.worlds, sent(given)),
        "the simulator's batch, Rust": (given.worlds, batch(given)),
    }
    turn_s = given.seconds / TURNS
    rates: dict[str, list[float]] = {name: [] for name in rows}
    for _ in range(TURNS):
        for name, (worlds, step) in rows.items():
            count, begun = 0, time.perf_counter()
            while (taken := time.perf_counter() - begun) < turn_s:
                step()
                count += worlds
            rates[name].append(count / taken)
    whole = statistics.median(rates["the simulator's batch, Rust"])
    for name, measured in rates.items():
        rate = statistics.median(measured)
        print(
            f"{name:32} {rate:>10,.0f} control steps/s {20 * rate:>12,.0f} physics steps/s "
            f"{rate / whole:6.1%} of the batch"
        )


def one(task: str) -> Callable[[], object]:
    """A step of one world."""
    env = AirHockeyEnv(task)  # type: ignore[arg-type]
    env.reset(seed=0)
    still = np.zeros(7)

    def step() -> None:
        *_, terminated, truncated, _ = env.step(still)
        if terminated or truncated:
            env.reset()

    return step


def make(given: argparse.Namespace, *, copy: bool) -> tuple[AirHockeyVectorEnv, np.ndarray]:
    """Worlds at their start, and actions of 0."""
    envs = AirHockeyVectorEnv(
        given.worlds, given.task, threads=given.threads, copy=copy, interpolation=3, autoreset_mode="SameStep"
    )
    envs.reset(seed=0)
    return envs, np.zeros((given.worlds, 14))


def many(given: argparse.Namespace, *, copy: bool) -> Callable[[], object]:
    """A step of many worlds."""
    envs, still = make(given, copy=copy)
    return lambda: envs.step(still)


def sent(given: argparse.Namespace) -> Callable[[], object]:
    """The same, sent and received."""
    envs, still = make(given, copy=False)

    def step() -> None:
        envs.send(still)
        envs.recv()

    return step


def batch(given: argparse.Namespace) -> Callable[[], object]:
    """The same without Python's half: worlds, episodes and actions alike, no rewards."""
    worlds = _native.Batch(given.task, given.worlds, given.threads)
    return worlds.step


if __name__ == "__main__":
    main()
