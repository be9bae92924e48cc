"""Checks and conversions of array arguments. The largest allowed number is that of `plain`, the module without NumPy."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import model, plain

Floats = NDArray[np.float64]


def finite(name: str, value: ArrayLike) -> Floats:
    """The argument as a float64 array of any shape; ValueError unless all numbers are within ±10,000."""
    try:
        array: NDArray[Any] = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: expected an array of numbers, got {value!r:.80}") from error
    # This comparison is false for NaN, too.
    is_allowed = np.abs(array) <= plain.NUMBER_LIMIT
    if not is_allowed.all():
        refused = array[~is_allowed].flat[0]
        raise ValueError(f"{name}: expected numbers within ±{plain.NUMBER_LIMIT:g}, got {refused}")
    return array


def joints(name: str, value: ArrayLike) -> Floats:
    """The argument as an array of shape (..., 7)."""
    array = finite(name, value)
    if array.ndim == 0 or array.shape[-1] != model.JOINTS:
        raise ValueError(f"{name}: expected shape (..., {model.JOINTS}), got {array.shape}")
    return array


def points(name: str, value: ArrayLike, z: float) -> Floats:
    """The argument as an array of shape (..., 3); `z` (m or m/s) completes points of shape (..., 2)."""
    array = finite(name, value)
    if array.ndim == 0 or array.shape[-1] not in (2, 3):
        raise ValueError(f"{name}: expected shape (..., 2) or (..., 3), got {array.shape}")
    if array.shape[-1] == 3:
        return array
    return np.concatenate([array, np.full((*array.shape[:-1], 1), z)], axis=-1)


def broadcast(names: str, *arrays: Floats) -> list[Floats]:
    """The arrays with their leading dimensions broadcast by NumPy's rules; `names` is for the error message."""
    try:
        leading = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
    except ValueError as error:
        shapes = ", ".join(str(array.shape) for array in arrays)
        raise ValueError(f"{names}: expected leading dimensions that fit, got {shapes}") from error
    return [np.broadcast_to(array, (*leading, array.shape[-1])) for array in arrays]
