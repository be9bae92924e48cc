"""Finds and imports the code of a team: `agent_builder.py` with `build_agent`."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from faceoff.errors import ArgumentError, ArgumentTypeError, MissingError, OrderError

Builder = Callable[..., Any]

PACKAGE = "air_hockey_agent"
"""The package in which agents of 2023 have their `agent_builder.py`."""

SUBSTITUTE = Path(__file__).parent / "substitute"
"""The folder with the package `air_hockey_challenge` that replaces the one of 2023."""

_ADVICE = {
    "air_hockey_challenge": "a bundle has what an agent needs to play (docs/from-2023.md lists it); keep "
    "other code in the "
    f"package {PACKAGE}",
    "baseline": "convert the folder above, which contains both baseline and air_hockey_agent",
    "mujoco": "use air_hockey_challenge.utils.kinematics, or bring MuJoCo in a container image",
    "mushroom_rl": "save the policy's weights as arrays or ONNX and compute it with NumPy, or bring MushroomRL in a "
    "container image",
}


def install_substitute() -> None:
    """Makes the substitute of `air_hockey_challenge` importable in this process."""
    loaded = sys.modules.get("air_hockey_challenge")
    if loaded is not None and not _is_below(getattr(loaded, "__file__", None), SUBSTITUTE):
        raise OrderError(
            "air_hockey_challenge: expected that it is not imported yet, got "
            f"{getattr(loaded, '__file__', None)}; load the agent in a process of its own"
        )
    _search_first(SUBSTITUTE)


def load_builder(team: Path) -> Builder:
    """`build_agent` of the folder `team`, which contains the package `air_hockey_agent`.

    The working folder becomes `team`: in 2023 agents were started from the folder above their package.
    """
    # Modules of a team may also import each other by their plain names.
    _search_first(team / PACKAGE)
    _search_first(team)
    install_substitute()
    os.chdir(team)
    try:
        module = importlib.import_module(f"{PACKAGE}.agent_builder")
    except ImportError as error:
        raise explain(error) from error
    builder = getattr(module, "build_agent", None)
    if builder is None:
        raise ArgumentError(
            f"{PACKAGE}/agent_builder.py: expected a function build_agent(env_info, **kwargs), got a file without it"
        )
    return checked_builder(builder)


def checked_builder(builder: object) -> Builder:
    """The argument, if it can be called."""
    if not callable(builder):
        raise ArgumentTypeError(f"build_agent: expected a function of env_info, got {builder!r:.80}")
    return builder


def explain(error: ImportError) -> MissingError:
    """The failed import with what was expected and what to do."""
    if isinstance(error, MissingError):
        return error
    name = error.name or "a module"
    advice = _ADVICE.get(
        name.partition(".")[0],
        "put it into the bundle, choose a runtime that has it (--runtime), or bring it in a container image",
    )
    if isinstance(error, ModuleNotFoundError):
        return MissingError(f"import of {name}: expected a module of the bundle or its runtime, got none; {advice}")
    return MissingError(f"import of {name}: expected that it succeeds, got: {error}; {advice}")


def _search_first(folder: Path) -> None:
    path = str(folder)
    if path in sys.path:
        sys.path.remove(path)
    sys.path.insert(0, path)


def _is_below(path: str | None, folder: Path) -> bool:
    return path is not None and Path(path).resolve().is_relative_to(folder.resolve())
