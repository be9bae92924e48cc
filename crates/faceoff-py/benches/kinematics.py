"""Time of `faceoff.kinematics.native` beside that of `faceoff.kinematics`, function by function, in the same run.

    python crates/faceoff-py/benches/kinematics.py [--batch 256] [--seconds 0.2]

Points are over the table, starts some centimetres away. The two take turns, so that a busy machine slows both down alike;
the median of the turns is told, for a batch and for a single pose or point.
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

TURNS = 9


def main() -> None:
    """Times all and prints a table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--batch", type=int, default=256)
    parser.add_argument("--seconds", type=float, default=0.2)
    given = parser.parse_args()
    draws = np.random.default_rng(0)
    points = draws.uniform([0.65, -0.4], [1.25, 0.4], (given.batch, 2))
    q, _ = arm.inverse(points + draws.normal(0.0, 0.03, points.shape))
    speeds = draws.normal(0.0, 1.0, points.shape)
    turn_s = given.seconds / TURNS
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
        for count, ready in (
            (given.batch, arguments),
            (1, tuple(each[0] for each in arguments)),
        ):
            numpys, natives = compare(getattr(arm, name), getattr(native, name), ready, turn_s)
            print(
                f"{label:24} {count:>6}: NumPy {1e6 * numpys:>9.1f} µs, native {1e6 * natives:>9.1f} µs, "
                f"{numpys / natives:5.1f} times"
            )


def compare(
    one: Callable[..., Any], other: Callable[..., Any], given: tuple[Any, ...], turn_s: float
) -> tuple[float, float]:
    """Seconds for a call of each."""
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(TURNS):
        for call, told in zip((one, other), times, strict=True):
            count, begun = 0, time.perf_counter()
            while (taken := time.perf_counter() - begun) < turn_s:
                call(*given)
                count += 1
            told.append(taken / count)
    return statistics.median(times[0]), statistics.median(times[1])


if __name__ == "__main__":
    main()
