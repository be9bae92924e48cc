"""Checks of arguments, and the environment setup that the native half (`faceoff._native`, compiled from Rust) reads.

A *perturbation* is one kind of difference from the ideal simulator; a *profile* is a set of active perturbations.
"""

from __future__ import annotations

import json
import math
import operator
from collections.abc import Iterable, Mapping
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from faceoff import _native
from faceoff.errors import ArgumentError, ArgumentTypeError

Task = Literal["hit", "defend", "prepare"]
ActionMode = Literal["delta", "absolute", "raw"]

TASKS: tuple[Task, ...] = ("hit", "defend", "prepare")
ACTION_MODES: tuple[ActionMode, ...] = ("delta", "absolute", "raw")
PERTURBATIONS = ("model_mismatch", "observation_noise", "disturbance", "tracking_loss", "delay")
PROFILES: dict[str, tuple[str, ...]] = {
    "ideal": (),
    **{perturbation: (perturbation,) for perturbation in PERTURBATIONS},
    "evaluation": PERTURBATIONS[:4],
}
#: Seeds are below this, so that they fit into int64 arrays.
SEED_BOUND = 2**63


def one_of(name: str, value: object, choices: Iterable[str]) -> str:
    """``value`` if it is one of ``choices``; ``name`` is the argument's, for the error message."""
    names = list(choices)
    if not isinstance(value, str):
        raise ArgumentTypeError(f"{name}: expected one of {', '.join(names)}, got {value!r}")
    if value not in names:
        raise ArgumentError(f"{name}: expected one of {', '.join(names)}, got {value!r}")
    return value


def integer(name: str, value: object, lowest: int, highest: int) -> int:
    """``value`` as an int from ``lowest`` to ``highest``, both included.

    Integers of other libraries are accepted, and floats without a fraction, as configuration files and hyperparameter
    searches hand over; a bool is refused.
    """
    number = _whole_number(value)
    if number is None:
        raise ArgumentTypeError(
            f"{name}: expected a whole number from {lowest} to {highest}, got {value!r:.80}"
        )
    if not lowest <= number <= highest:
        raise ArgumentError(f"{name}: expected a whole number from {lowest} to {highest}, got {number}")
    return number


def _whole_number(value: object) -> int | None:
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, (bool, np.bool_)):
        return None
    if isinstance(value, (float, np.floating)):
        return int(value) if float(value).is_integer() else None
    try:
        return operator.index(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, RuntimeError):  # the last two from tensors
        return None


def flag(name: str, value: object) -> bool:
    """``value`` as a bool: one of Python or NumPy, or 0 or 1. Others are refused: the text "False", for example, is true."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, (bool, np.bool_)) or (isinstance(value, (int, np.integer)) and value in (0, 1)):
        return bool(value)
    raise ArgumentTypeError(f"{name}: expected True or False, got {value!r:.80}")


def real(name: str, value: object, above: float, highest: float) -> float:
    """``value`` as a float above ``above`` and up to ``highest``."""
    try:
        number = float(value)  # type: ignore[arg-type]
    except OverflowError:
        number = math.inf
    except (TypeError, ValueError, RuntimeError):
        number = math.nan
    if isinstance(value, (str, bytes, bool, np.bool_)) or math.isnan(number):
        raise ArgumentTypeError(f"{name}: expected a number above {above:g} and up to {highest:g}, got {value!r:.80}")
    if not above < number <= highest:
        raise ArgumentError(f"{name}: expected a number above {above:g} and up to {highest:g}, got {number:g}")
    return number


def known_names(function: str, given: Iterable[str], known: Iterable[str]) -> None:
    """Refuses the first name of ``given`` that is not an argument of ``function``."""
    names = list(known)
    for name in given:
        if name not in names:
            raise ArgumentTypeError(f"{function}: expected arguments among {', '.join(names)}, got {name}")


def seed_number(name: str, value: object) -> int:
    """``value`` as a seed of an environment: 0 to ``SEED_BOUND`` - 1."""
    return integer(name, value, 0, SEED_BOUND - 1)


def numbers(name: str, value: object, shape: tuple[int, ...]) -> npt.NDArray[np.float64]:
    """``value`` as a contiguous float64 array of this shape; NaN and infinity are not refused here."""
    try:
        array = np.asarray(value)
    except (ValueError, TypeError, RuntimeError) as error:
        # Ragged lists, and tensors on another device or with gradients.
        raise ArgumentError(f"{name}: expected an array of shape {shape}, got {error}") from None
    if array.dtype.kind not in "fiu":
        raise ArgumentTypeError(f"{name}: expected real numbers, got {array.dtype} ({value!r:.80})")
    if array.shape != shape:
        raise ArgumentError(f"{name}: expected an array of shape {shape}, got one of shape {array.shape}")
    return np.ascontiguousarray(array, dtype=np.float64)


def mask(name: str, value: object, length: int) -> npt.NDArray[np.bool_]:
    """``value`` as a mask of this length with at least one true element."""
    if not isinstance(value, np.ndarray) or value.dtype != np.bool_:
        raise ArgumentTypeError(f"{name}: expected a NumPy array of bool, got {value!r:.80}")
    if value.shape != (length,):
        raise ArgumentError(f"{name}: expected an array of shape ({length},), got one of shape {value.shape}")
    if not value.any():
        raise ArgumentError(f"{name}: expected at least one true value, got none")
    return np.ascontiguousarray(value)


def interpolation_code(value: object) -> int | None:
    """``value`` as an interpolation code of the protocol: 1 to 5, -1 or None."""
    if value is None:
        return None
    code = integer("interpolation", value, -1, 5)
    _native.action_shape(code)
    return code


def perturbation_names(profile: object) -> list[str]:
    """The perturbations of a named profile, or of a sequence of their names, in the order of ``PERTURBATIONS``."""
    if isinstance(profile, str):
        return list(PROFILES[one_of("profile", profile, PROFILES)])
    if not isinstance(profile, Iterable):
        raise ArgumentTypeError(
            f"profile: expected a profile's name or names of perturbations, got {profile!r}"
        )
    names = [one_of("profile", name, PERTURBATIONS) for name in profile]
    return [perturbation for perturbation in PERTURBATIONS if perturbation in names]


def perturbations_json(perturbations: object) -> Any:
    """Magnitudes of perturbations as a dictionary for JSON."""
    if perturbations is None:
        return {}
    if not isinstance(perturbations, Mapping):
        raise ArgumentTypeError(
            f"perturbations: expected a mapping like {{'tracking_loss': {{'probability': 0.0}}}}, "
            f"got {perturbations!r:.80}"
        )
    return _json_value("perturbations", perturbations)


def _json_value(place: str, value: object) -> Any:
    """``value`` with numbers and arrays of NumPy as those of Python."""
    if isinstance(value, (np.generic, np.ndarray)):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(name): _json_value(f"{place}[{name!r}]", member) for name, member in value.items()}
    if isinstance(value, (list, tuple)):
        return [_json_value(f"{place}[{index}]", member) for index, member in enumerate(value)]
    if value is None or isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, float) and math.isfinite(value):
        return value
    raise ArgumentError(f"{place}: expected finite numbers in mappings, got {value!r:.80}")


def mismatch_seed_text(value: object) -> str | None:
    """The seed of the model mismatch as text, or None to derive it from the episode's seed."""
    if value is None:
        return None
    return seed_text("mismatch_seed", value)


def seed_text(name: str, value: object) -> str:
    """A seed as text, as the command line accepts it: a number below 2**64 or 64 hexadecimal digits."""
    if isinstance(value, str):
        if len(value) == 64 and all(digit in "0123456789abcdefABCDEF" for digit in value):
            return value
        raise ArgumentError(f"{name}: expected a number or 64 hexadecimal digits, got {value!r:.80}")
    return str(integer(name, value, 0, 2**64 - 1))


def write_setup(
    *,
    task: object,
    interpolation: int | None,
    action_mode: object,
    clip_actions: object,
    profile: object,
    perturbations: object,
    mismatch_seed: object,
    max_episode_steps: object,
) -> str:
    """Checks the arguments of an environment and returns them as JSON for the native half."""
    steps = _native.EPISODE_STEPS
    horizon = steps if max_episode_steps is None else max_episode_steps
    setup = {
        "task": one_of("task", task, TASKS),
        "interpolation": interpolation_code(interpolation),
        "action_mode": one_of("action_mode", action_mode, ACTION_MODES),
        "clip_actions": flag("clip_actions", clip_actions),
        # "factors" is the earlier word for perturbations, which pickled states contain.
        "factors": perturbation_names(profile),
        "perturbations": perturbations_json(perturbations),
        "mismatch_seed": mismatch_seed_text(mismatch_seed),
        "max_episode_steps": integer("max_episode_steps", horizon, 1, steps),
    }
    return json.dumps(setup, allow_nan=False)


def action_len(interpolation: int | None) -> int:
    """Count of numbers in an action."""
    return math.prod(_native.action_shape(interpolation))
