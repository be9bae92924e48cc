"""Writes a bundle: the folder of an agent."""

from __future__ import annotations

import json
import os
import re
import shutil
from pathlib import Path
from typing import Any

from faceoff import _native
from faceoff._export.environment import PolicyEnvironment
from faceoff._folders import copy_parts, new_folder
from faceoff.errors import ArgumentError, ArgumentTypeError

#: Parts of the package that each agent needs, and those for mallet actions.
PARTS = ("__init__.py", "errors.py", "agent.py", "actions.py")
MALLET_PARTS = ("kinematics",)
#: The evaluator's limit on an agent's name, characters.
LONGEST_NAME = 60


def check_folder(folder: object) -> Path:
    """`folder` as a path of a bundle that can be created there."""
    if not isinstance(folder, (str, os.PathLike)):
        raise ArgumentTypeError(f"folder: expected the path of a folder to create, got {folder!r:.80}")
    path = Path(os.path.abspath(folder))
    if os.path.lexists(path):
        raise ArgumentError(f"folder: expected a path that does not exist, got {path}: choose another, or remove it first")
    if not path.parent.is_dir():
        raise ArgumentError(f"folder: expected a path in an existing folder, got {path}: create {path.parent} first")
    return path


def check_name(name: object, folder: Path) -> str:
    """The agent's name; by default that of the folder."""
    if name is None:
        name = folder.name[:LONGEST_NAME]
    if not isinstance(name, str):
        raise ArgumentTypeError(f"name: expected text, got {name!r:.80}")
    if not 1 <= len(name) <= LONGEST_NAME or not name.isprintable():
        raise ArgumentError(f"name: expected 1 to {LONGEST_NAME} printable characters, got {name!r:.80}")
    return name


def write(folder: Path, name: str, model: Any, environment: PolicyEnvironment) -> None:
    """Writes the bundle."""
    has_mallet = environment.mallet_speed_m_s is not None
    with new_folder("folder", folder) as unfinished:
        (unfinished / "agent.toml").write_text(_manifest(name, environment), encoding="utf-8")
        (unfinished / "agent.py").write_text(_agent(environment), encoding="utf-8")
        (unfinished / "policy.onnx").write_bytes(model.SerializeToString())
        copy_parts((*PARTS, *(MALLET_PARTS if has_mallet else ())), unfinished)
        if has_mallet:
            shutil.copyfile(str(_native.__file__), unfinished / "faceoff" / "_native.abi3.so")


def _manifest(name: str, environment: PolicyEnvironment) -> str:
    lines = [
        "# How the evaluator starts this agent.",
        f"name = {json.dumps(name, ensure_ascii=False)}",
        'command = ["python3", "agent.py"]',
        'runtime = "python3-ml" # NumPy and ONNX Runtime',
    ]
    # TOML has no null: without the key the agent states its interpolation itself.
    if environment.interpolation is not None:
        lines.append(f"interpolation = {environment.interpolation}")
    return "\n".join(lines) + "\n"


def _agent(environment: PolicyEnvironment) -> str:
    """The template with the values of this environment."""
    text = (Path(__file__).parent / "agent_template.py").read_text(encoding="utf-8")
    values = {
        "TASK": environment.task,
        "ACTION_MODE": environment.action_mode,
        "INTERPOLATION": environment.interpolation,
        "CLIP_ACTIONS": environment.clip_actions,
        "MALLET_SPEED_M_S": environment.mallet_speed_m_s,
        "FRAMES": environment.frames,
    }
    for constant, value in values.items():
        line = re.compile(rf"^({constant}: [^=]+= ).*$", re.MULTILINE)
        literal = json.dumps(value) if isinstance(value, str) else repr(value)
        text, count = line.subn(lambda match, literal=literal: match[1] + literal, text)  # type: ignore[misc]
        assert count == 1, constant
    return text
