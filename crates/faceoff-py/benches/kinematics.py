"""Compares the times of `faceoff.kinematics.native` and `faceoff.kinematics`, function by function.

    python crates/faceoff-py/benches/kinematics.py [--batch 256] [--seconds 0.2]

Points are over the table, start poses some centimetres away. The two modules alternate, so that a busy machine affects
both alike; prints the median over the rounds, for a batch and for a single pose or point.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from faceoff import kinematics as arm
from faceoff.kinematics import native

ROUNDS = 9


def main() -> None:
    """Measures all functions and prints a table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--batch", type=int, default=256)
    parser.add_argument("--seconds", type=float, default=0.2)
    options = parser.parse_args()
    draws = np.random.default_rng(0)
    points = draws.uniform([0.65, -0.4], [1.25, 0.4], (options.batch, 2))
    q, _ = arm.inverse(points + draws.normal(0.0, 0.03, points.shape))
    speeds = draws.normal(0.0, 1.0, points.shape)
    round_s = options.seconds / ROUNDS
    for name, arguments in (
        ("inverse", (points,)),
        ("inverse", (points, q)),
        ("forward", (q,)),
        ("jacobian", (q,)),
        ("posture_velocities", (points, speeds)),
        ("velocities", (q, speeds)),
        ("constraints", (q, q)),
    ):
        label = f"{name} from a start" if name == "inverse" and len(arguments) == 2 else name
        for count, call_arguments in (
            (options.batch, arguments),
            (1, tuple(argument[0] for argument in arguments)),
        ):
            numpy_s, native_s = compare(getattr(arm, name), getattr(native, name), call_arguments, round_s)
            print(
                f"{label:24} {count:>6}: NumPy {1e6 * numpy_s:>9.1f} µs, native {1e6 * native_s:>9.1f} µs, "
                f"{numpy_s / native_s:5.1f} times"
            )


def compare(
    first: Callable[..., Any], second: Callable[..., Any], arguments: tuple[Any, ...], round_s: float
) -> tuple[float, float]:
    """Median seconds per call of each function."""
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(ROUNDS):
        for call, samples in zip((first, second), times, strict=True):
            count, started_s = 0, time.perf_counter()
            while (elapsed_s := time.perf_counter() - started_s) < round_s:
                call(*arguments)
                count += 1
            samples.append(elapsed_s / count)
    return statistics.median(times[0]), statistics.median(times[1])


if __name__ == "__main__":
    main()
