"""What the functions of this package ask of their arguments."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from faceoff.kinematics import model, plain

Floats = NDArray[np.float64]


def finite(name: str, given: ArrayLike) -> Floats:
    """The argument as an array of float64 within ±10,000, of any shape; ValueError that names it otherwise."""
    try:
        array: NDArray[Any] = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: expected an array of numbers, got {given!r:.80}") from error
    # Written so that a number that is none fails.
    good = np.abs(array) <= plain.NUMBER_LIMIT
    if not good.all():
        worst = array[~good].flat[0]
        raise ValueError(f"{name}: expected numbers within ±{plain.NUMBER_LIMIT:g}, got {worst}")
    return array


def joints(name: str, given: ArrayLike) -> Floats:
    """The argument as (..., 7)."""
    array = finite(name, given)
    if array.ndim == 0 or array.shape[-1] != model.JOINTS:
        raise ValueError(f"{name}: expected shape (..., {model.JOINTS}), got {array.shape}")
    return array


def points(name: str, given: ArrayLike, z: float) -> Floats:
    """The argument as (..., 3); of x and y alone, `z` (m or m/s) is added."""
    array = finite(name, given)
    if array.ndim == 0 or array.shape[-1] not in (2, 3):
        raise ValueError(f"{name}: expected shape (..., 2) or (..., 3), got {array.shape}")
    if array.shape[-1] == 3:
        return array
    return np.concatenate([array, np.full((*array.shape[:-1], 1), z)], axis=-1)


def together(names: str, *arrays: Floats) -> list[Floats]:
    """The arrays with equal leading dimensions, by NumPy's rules of broadcasting."""
    try:
        leading = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
    except ValueError as error:
        shapes = ", ".join(str(array.shape) for array in arrays)
        raise ValueError(f"{names}: expected leading dimensions that fit, got {shapes}") from error
    return [np.broadcast_to(array, (*leading, array.shape[-1])) for array in arrays]
