"""Control steps per CPU second of other environments of robots, for comparison with `throughput.py`.

    pip install envpool "gymnasium[mujoco]"
    python crates/faceoff-py/benches/other_simulators.py [--worlds 256] [--threads 2] [--seconds 3]

EnvPool steps many worlds in threads, Gymnasium one; actions are 0. What is simulated differs from air hockey, so these figures say what a
learner is used to, not which simulator is better.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable

import envpool
import gymnasium
import numpy as np

ROUNDS = 7
TASKS = {"HalfCheetah": ("HalfCheetah-v4", "HalfCheetah-v5"), "Ant": ("Ant-v4", "Ant-v5")}


def main() -> None:
    """Measures both libraries in turn, and prints medians."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--worlds", type=int, default=256)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=3.0)
    options = parser.parse_args()
    rows: dict[str, tuple[int, Callable[[], object]]] = {}
    for task, (pooled, single) in TASKS.items():
        rows[f"EnvPool {task}"] = (options.worlds, step_pool(pooled, options))
        rows[f"Gymnasium {task}"] = (1, step_one(single))
    rates: dict[str, list[float]] = {name: [] for name in rows}
    for _ in range(ROUNDS):
        for name, (worlds, step) in rows.items():
            count, started_s, started_cpu_s = 0, time.perf_counter(), time.process_time()
            while time.perf_counter() - started_s < options.seconds / ROUNDS:
                step()
                count += worlds
            rates[name].append(count / (time.process_time() - started_cpu_s))
    for name, measured in rates.items():
        print(f"{name:24} {statistics.median(measured):>10,.0f} control steps per CPU second")


def step_pool(task: str, options: argparse.Namespace) -> Callable[[], object]:
    """A function that steps EnvPool's worlds."""
    envs = envpool.make_gymnasium(task, num_envs=options.worlds, num_threads=options.threads)
    envs.reset()
    zeros = np.zeros((options.worlds, *envs.action_space.shape))
    return lambda: envs.step(zeros)


def step_one(task: str) -> Callable[[], object]:
    """A function that steps one world of Gymnasium."""
    env = gymnasium.make(task)
    env.reset(seed=0)
    zeros = np.zeros(env.action_space.shape)  # type: ignore[arg-type]

    def step() -> None:
        *_, terminated, truncated, _ = env.step(zeros)
        if terminated or truncated:
            env.reset()

    return step


if __name__ == "__main__":
    main()
