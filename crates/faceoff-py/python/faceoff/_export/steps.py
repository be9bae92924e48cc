"""Elementwise operations of an environment's wrappers, in NumPy and as nodes of an ONNX graph with the same rounding."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

_FUNCTIONS = {
    "Add": np.add,
    "Sub": np.subtract,
    "Mul": np.multiply,
    "Div": np.divide,
    "Max": np.maximum,
    "Min": np.minimum,
}


@dataclass(frozen=True)
class Step:
    """An operation on each number of observations or actions, (n, length)."""

    operator: str
    """Name of the operation in ONNX: a key of `_FUNCTIONS`, or `Cast`, which rounds to the operand's precision."""
    operand: Array
    """float32 or float64, (length,) or ()."""

    def apply(self, values: Array) -> Array:
        """The result in NumPy; as there, an operand in double precision makes the result double."""
        if self.operator == "Cast":
            return values.astype(self.operand.dtype)
        result: Array = _FUNCTIONS[self.operator](values, self.operand)
        return result


def apply_all(steps: Iterable[Step], values: Array) -> Array:
    """The steps in order; the result is in single precision."""
    for step in steps:
        values = step.apply(values)
    return values.astype(np.float32)


def clip(low: Array, high: Array) -> list[Step]:
    """Limits values to bounds, which may be infinite."""
    return [Step("Max", np.asarray(low, np.float32)), Step("Min", np.asarray(high, np.float32))]


def normalise(mean: Array, variance: Array, epsilon: float, largest: float | None) -> list[Step]:
    """Normalises observations as Gymnasium and Stable-Baselines3 do; with `largest` they are clipped to ± it."""
    steps = [Step("Sub", np.asarray(mean)), Step("Div", np.sqrt(np.asarray(variance) + epsilon))]
    if largest is not None:
        precision = steps[0].operand.dtype
        steps += [Step("Max", np.asarray(-largest, precision)), Step("Min", np.asarray(largest, precision))]
    return [*steps, Step("Cast", np.float32(0.0))]  # type: ignore[arg-type]


def unscale(low: Array, high: Array) -> list[Step]:
    """Converts actions from [-1, 1] to bounds, in the operations of Stable-Baselines3."""
    low, high = np.asarray(low, np.float32), np.asarray(high, np.float32)
    one, half = np.float32(1.0), np.float32(0.5)
    return [Step("Add", one), Step("Mul", half), Step("Mul", high - low), Step("Add", low)]  # type: ignore[arg-type]
