"""Checks of arguments. Only NumPy is needed: this file is part of every converted bundle."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from faceoff.errors import ArgumentError, ArgumentTypeError

Floats = npt.NDArray[np.float64]


def array(name: str, value: object, *shapes: tuple[int, ...]) -> Floats:
    """``value`` as float64 with one of the ``shapes``; all numbers are finite."""
    expected = " or ".join(str(shape) for shape in shapes)
    try:
        numbers: Floats = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"{name}: expected numbers of shape {expected}, got {value!r:.80}") from None
    if numbers.shape not in shapes:
        raise ArgumentError(f"{name}: expected shape {expected}, got {numbers.shape}")
    if not np.isfinite(numbers).all():
        raise ArgumentError(f"{name}: expected finite numbers, got {numbers[~np.isfinite(numbers)].flat[0]}")
    return numbers


def number(name: str, value: object) -> float:
    """``value`` if it is a finite number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
        raise ArgumentTypeError(f"{name}: expected a finite number, got {value!r:.80}")
    return value


def path_of(name: str, value: object, kind: str) -> Path:
    """``value`` as a path; `kind` says in the error message what it should be the path of."""
    if not isinstance(value, (str, os.PathLike)) or not os.fspath(value):
        raise ArgumentTypeError(f"{name}: expected the path of {kind}, got {value!r:.80}")
    return Path(value)


def one_of(name: str, value: object, choices: Iterable[object]) -> None:
    """Refuses a ``value`` that is not one of ``choices``."""
    known = list(choices)
    # By type, too: True is equal to 1.
    if not any(value == choice and type(value) is type(choice) for choice in known):
        raise ArgumentError(f"{name}: expected one of {', '.join(map(str, known))}, got {value!r}")


def entry(name: str, mapping: object, *keys: str) -> Any:
    """The value at nested ``keys`` of a mapping named ``name``."""
    path, value = name, mapping
    for key in keys:
        if not isinstance(value, Mapping):
            raise ArgumentTypeError(f"{path}: expected a mapping with the key {key!r}, got {value!r:.80}")
        if key not in value:
            raise ArgumentError(
                f"{path}: expected the key {key!r}, got {', '.join(map(str, value)) or 'no keys'}; "
                "give the env of the message hello"
            )
        path, value = f"{path}[{key!r}]", value[key]
    return value
