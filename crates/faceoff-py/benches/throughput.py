"""Control steps per second of the Python environments, compared with the simulator's batch.

    python crates/faceoff-py/benches/throughput.py [--worlds 256] [--threads 2] [--seconds 3] [--task prepare] [--games 128]

Arms hold still (actions of 0). A control step is 20 physics steps; one of a game moves two arms. Measurements alternate, so
that a busy machine affects all alike; prints medians over the rounds, per second and per second of CPU time.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable

import numpy as np

from faceoff import _native
from faceoff.game import AirHockeyGameVectorEnv
from faceoff.gym import AirHockeyEnv, AirHockeyVectorEnv

ROUNDS = 7
BATCH = "the simulator's batch, Rust"


def main() -> None:
    """Measures all variants and prints a table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--worlds", type=int, default=256)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--task", default="prepare")
    parser.add_argument("--games", type=int, default=128)
    options = parser.parse_args()
    rows = {
        "one world, Python": (1, step_one(options.task)),
        "vector environment, copy": (options.worlds, step_many(options, copy=True)),
        "vector environment, no copy": (options.worlds, step_many(options, copy=False)),
        "vector environment, send/recv": (options.worlds, send_and_receive(options)),
        BATCH: (options.worlds, step_batch(options)),
        "games, both sides": (options.games, step_games(options)),
    }
    round_s = options.seconds / ROUNDS
    rates: dict[str, list[tuple[float, float]]] = {name: [] for name in rows}
    for _ in range(ROUNDS):
        for name, (worlds, step) in rows.items():
            count, started_s, started_cpu_s = 0, time.perf_counter(), time.process_time()
            while (elapsed_s := time.perf_counter() - started_s) < round_s:
                step()
                count += worlds
            rates[name].append((count / elapsed_s, count / (time.process_time() - started_cpu_s)))
    medians = {name: [statistics.median(kind) for kind in zip(*measured, strict=True)] for name, measured in rates.items()}
    for name, (rate, cpu_rate) in medians.items():
        print(
            f"{name:32} {rate:>10,.0f} control steps/s {20 * rate:>12,.0f} physics steps/s "
            f"{cpu_rate:>10,.0f} per CPU second {cpu_rate / medians[BATCH][1]:6.1%} of the batch"
        )


def step_one(task: str) -> Callable[[], object]:
    """A function that steps one world."""
    env = AirHockeyEnv(task)  # type: ignore[arg-type]
    env.reset(seed=0)
    zeros = np.zeros(7)

    def step() -> None:
        *_, terminated, truncated, _ = env.step(zeros)
        if terminated or truncated:
            env.reset()

    return step


def make_worlds(options: argparse.Namespace, *, copy: bool) -> tuple[AirHockeyVectorEnv, np.ndarray]:
    """Worlds after a reset, and actions of 0."""
    envs = AirHockeyVectorEnv(
        options.worlds, options.task, threads=options.threads, copy=copy, interpolation=3, autoreset_mode="SameStep"
    )
    envs.reset(seed=0)
    return envs, np.zeros((options.worlds, 14))


def step_many(options: argparse.Namespace, *, copy: bool) -> Callable[[], object]:
    """A function that steps many worlds."""
    envs, zeros = make_worlds(options, copy=copy)
    return lambda: envs.step(zeros)


def send_and_receive(options: argparse.Namespace) -> Callable[[], object]:
    """A function that steps many worlds by `send` and `recv`."""
    envs, zeros = make_worlds(options, copy=False)

    def step() -> None:
        envs.send(zeros)
        envs.recv()

    return step


def step_games(options: argparse.Namespace) -> Callable[[], object]:
    """A function that steps many games of two robots."""
    games = AirHockeyGameVectorEnv(options.games, threads=options.threads, copy=False, autoreset_mode="SameStep")
    games.reset(seed=0)
    zeros = np.zeros((2 * options.games, 7))
    return lambda: games.step(zeros)


def step_batch(options: argparse.Namespace) -> Callable[[], object]:
    """A function that steps the simulator's batch: the same worlds and actions, without rewards."""
    worlds = _native.Batch(options.task, options.worlds, options.threads)
    return worlds.step


if __name__ == "__main__":
    main()
