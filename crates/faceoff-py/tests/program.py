"""Runs the program `faceoff` for the reference values of the tests."""

import json
import os
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

REPOSITORY = Path(__file__).parents[3]
PROGRAM = Path(os.environ.get("FACEOFF_BIN", REPOSITORY / "target" / "debug" / "faceoff"))


def faceoff(*arguments: str, stdin: str = "") -> str:
    """The output of the program, which must succeed."""
    done = subprocess.run([PROGRAM, *arguments], input=stdin, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@cache
def exported_model(format_: str, model: str = "plant") -> str:
    """The output of `faceoff sim export`."""
    return faceoff("sim", "export", "--format", format_, "--model", model)


def kinematics(poses: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The results of `faceoff sim kinematics`, one per pose."""
    return lines(faceoff("sim", "kinematics", stdin="\n".join(map(json.dumps, poses))))


def trace(scenario: dict[str, Any]) -> list[dict[str, Any]]:
    """The states of `faceoff sim trace`."""
    return lines(faceoff("sim", "trace", stdin=json.dumps(scenario)))


def lines(text: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in text.splitlines()]
