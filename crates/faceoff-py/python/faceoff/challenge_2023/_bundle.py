"""Makes a bundle from the folder of a team of 2023."""

from __future__ import annotations

import ast
import json
import os
import shutil
import stat
from pathlib import Path

from faceoff._folders import copy_parts, new_folder
from faceoff.challenge_2023._adapter import CONFIG_FILE, TEAM_FOLDER
from faceoff.challenge_2023._arguments import path_of
from faceoff.challenge_2023._config import interpolation_order, read_config
from faceoff.challenge_2023._loading import PACKAGE
from faceoff.errors import ArgumentError, ArgumentTypeError

RUNTIME = "python3-ml"
"""The runtime with NumPy that servers usually offer (docs/sandbox.md)."""

PROGRAM = "play_2023.py"
"""The program of a converted bundle."""

#: Parts of this package for the bundle. They need only NumPy.
_PARTS = ("__init__.py", "_folders.py", "agent.py", "errors.py", "kinematics", "challenge_2023")
#: Folders that are not part of an agent.
_LEFT_OUT = ("__pycache__", ".git")
#: The package of 2023, which is left out, too: it would hide its substitute.
_REPLACED = "air_hockey_challenge"

_PROGRAM_TEXT = f'''"""Plays the agent of 2023 in the folder `{TEAM_FOLDER}`."""

from pathlib import Path

from faceoff.challenge_2023 import play

if __name__ == "__main__":
    play(Path(__file__).parent)
'''
# The evaluator's limits on the name and the runtime of an agent, characters.
_NAME_LENGTH_MAX = 60
_RUNTIME_LENGTH_MAX = 40


def make_bundle(folder: str | Path, bundle: str | Path, *, name: str | None = None, runtime: str = RUNTIME) -> None:
    """Makes the folder `bundle` from a team's folder of 2023.

    Args:
        folder: the package `air_hockey_agent` with `agent_builder.py`, or the folder above it.
        bundle: the folder to make.
        name: the agent's name on the board; by default that of the folder `bundle`.
        runtime: interpreter and libraries on the server (docs/sandbox.md); NumPy must be among them.

    The team's files are copied unchanged. Nothing remains of a bundle that could not be completed.
    """
    source, target = (
        path_of(key, value, "a folder").absolute() for key, value in (("folder", folder), ("bundle", bundle))
    )
    title = _text("name", target.name if name is None else name, _NAME_LENGTH_MAX)
    _text("runtime", runtime, _RUNTIME_LENGTH_MAX)
    package = _find_package(source)
    _check_builder(package / "agent_builder.py")
    if target.exists() or target.is_symlink():
        raise ArgumentError(
            f"bundle: expected a new folder, got {str(target)!r}, which exists; choose another name, or remove it"
        )
    if target.resolve().is_relative_to(source.resolve()):
        raise ArgumentError(f"bundle: expected a folder outside {str(source)!r}, got {str(target)!r}")
    config = read_config(package / "agent_config.yml")
    with new_folder("bundle", target) as unfinished:
        # A package alone gets the folder above it, where its own modules look for it.
        into = unfinished / TEAM_FOLDER
        _copy(source, into / PACKAGE if package == source else into)
        _write_program(unfinished, title, runtime, interpolation_order(config))
        (unfinished / CONFIG_FILE).write_text(json.dumps(config, indent=1) + "\n", encoding="utf-8")


def _text(name: str, value: object, longest: int) -> str:
    if not isinstance(value, str):
        raise ArgumentTypeError(f"{name}: expected a text, got {value!r}")
    if not value.strip() or len(value) > longest or not value.isprintable():
        raise ArgumentError(f"{name}: expected 1 to {longest} printable characters, got {value!r:.80}")
    return value


def _find_package(folder: Path) -> Path:
    """The folder of `agent_builder.py`."""
    if not folder.is_dir():
        raise ArgumentError(f"folder: expected a team's folder of 2023, got {str(folder)!r}, which is no folder")
    for package in (folder, folder / PACKAGE):
        if (package / "agent_builder.py").is_file():
            return package
    raise ArgumentError(
        f"folder: expected agent_builder.py or {PACKAGE}/agent_builder.py in {str(folder)!r}, got "
        "neither; name the folder that contains agent_builder.py"
    )


def _check_builder(path: Path) -> None:
    """Refuses a file in which `build_agent` is neither defined nor imported."""
    try:
        tree = ast.parse(path.read_bytes(), str(path))
    except (SyntaxError, ValueError) as error:
        raise ArgumentError(f"{path}: expected a Python file, got {error}") from error
    for node in ast.walk(tree):
        match node:
            case ast.FunctionDef(name="build_agent") | ast.Name(id="build_agent", ctx=ast.Store()):
                return
            case ast.ImportFrom(names=names) if any(
                (alias.asname or alias.name) in ("build_agent", "*") for alias in names
            ):
                return
    raise ArgumentError(
        f"{path}: expected a function build_agent(env_info, **kwargs), got a file without it; add the function that "
        "returns the agent"
    )


def _copy(source: Path, target: Path) -> None:
    """Copies a team's files without following links; refuses what a bundle cannot contain."""
    root = source.resolve()

    def left_out(folder: str, names: list[str]) -> set[str]:
        replaced = (_REPLACED,) if Path(folder).resolve() == root else ()
        skipped = {name for name in names if name in (*_LEFT_OUT, *replaced)}
        for name in set(names) - skipped:
            _check_entry(root, Path(folder) / name)
        return skipped

    try:
        shutil.copytree(source, target, symlinks=True, ignore=left_out)
    except (OSError, shutil.Error) as error:
        raise ArgumentError(f"folder: expected files that can be read, got {error}") from error


def _check_entry(root: Path, path: Path) -> None:
    mode = path.lstat().st_mode
    if stat.S_ISLNK(mode):
        destination = os.readlink(path)
        if os.path.isabs(destination) or not path.resolve().is_relative_to(root):
            raise ArgumentError(
                f"folder: expected links within {str(root)!r}, got {str(path)!r}, which leads to "
                f"{destination!r}; copy the file into the folder"
            )
    elif not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise ArgumentError(
            f"folder: expected files, folders and links, got {str(path)!r}, which is none of them; remove it"
        )


def _write_program(folder: Path, name: str, runtime: str, order: int | None) -> None:
    """The parts of the bundle that are not the team's."""
    lines = [
        f"name = {json.dumps(name, ensure_ascii=False)}",
        f'command = ["python3", "{PROGRAM}"]',
        f"runtime = {json.dumps(runtime, ensure_ascii=False)}",
    ]
    # TOML has no null: an agent that sends whole trajectories announces it when it is ready.
    if order is not None:
        lines.append(f"interpolation = {order}")
    (folder / "agent.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / PROGRAM).write_text(_PROGRAM_TEXT, encoding="utf-8")
    copy_parts(_PARTS, folder)
