"""The commands in the examples' README reproduce the results in their logs."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "agents" / "examples"
TARGET = Path(os.environ.get("TARGET_DIR", ROOT / "target"))


@pytest.mark.parametrize(
    "command",
    [
        ["train_ppo.py", "--seed", "2"],
        ["clone_striker.py", "--program", TARGET / "release" / "faceoff", "--bundle", TARGET / "bundles" / "striker"],
    ],
    ids=["ppo", "clone"],
)
def test_new_training_beats_holding_by_30_percentage_points(command: list[str | Path], tmp_path: Path) -> None:
    program, *arguments = command
    subprocess.run([sys.executable, EXAMPLES / program, *arguments, "--out", tmp_path], check=True)
    log = (tmp_path / "log.txt").read_text()
    reached = {name: float(share) for name, share in re.findall(r"^(weights\.npz|hold) .*: ([0-9.]+) %", log, re.M)}
    assert reached["weights.npz"] >= reached["hold"] + 30.0, log
