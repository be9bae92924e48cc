"""Recordings that the tests of `faceoff.dataset` share, made by the program `faceoff` once per run."""

from __future__ import annotations

import atexit
import json
import os
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
FIXTURES = ROOT / "tests" / "fixtures"
PROGRAM = Path(os.environ.get("FACEOFF_BIN", ROOT / "target" / "debug" / "faceoff"))

# An agent with the interpolations 5 and null (rules by which an action becomes a trajectory). It violates limits, sends an
# invalid answer in one episode, and exits at the reset of another.
ODD_AGENT = """
import json, sys
for line in sys.stdin:
    message = json.loads(line)
    kind = message["type"]
    if kind == "hello":
        task = message["task"]
        code = 5 if task == "hit" else None
        answer = {"type": "ready", "protocol": 1, "interpolation": code}
    elif kind == "reset":
        episode = message["episode"]
        if episode == 1:
            sys.exit(3)
        answer = {"type": "ready", "episode": episode}
    elif kind == "step":
        if (episode, message["step"]) == (0, 7):
            print("nonsense", flush=True)
            continue
        zeros = [0.0] * 7
        command = [[q + 0.01 for q in message["obs"][6:13]], zeros, zeros]
        action = command if task == "hit" else [command] * 20
        answer = {"type": "act", "step": message["step"], "action": action}
    else:
        continue
    print(json.dumps(answer), flush=True)
"""
ODD_MANIFEST = 'name = "odd"\ncommand = ["python3", "agent.py"]\nruntime = "python3"\n'


@cache
def folder() -> Path:
    """A temporary folder that is removed after the tests."""
    path = Path(tempfile.mkdtemp(prefix="faceoff-dataset-"))
    atexit.register(shutil.rmtree, path, ignore_errors=True)
    return path


def faceoff(*arguments: str | Path) -> str:
    """Runs the program; returns its output."""
    done = subprocess.run(
        [PROGRAM, *arguments], cwd=folder(), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{arguments}: {done.stderr}"
    return done.stdout


@cache
def hold() -> Path:
    """Three episodes per task of an agent that holds still."""
    out = folder() / "hold"
    faceoff(
        *("eval", ROOT / "agents" / "hold", "--no-sandbox", "--episodes", "3", "--seed", "5"),
        *("--out", out),
    )
    return out


@cache
def odd() -> Path:
    """Three episodes of `hit` and `defend`: one is aborted, one never begins, one is complete."""
    bundle, out = folder() / "odd-agent", folder() / "odd"
    bundle.mkdir()
    (bundle / "agent.py").write_text(ODD_AGENT)
    (bundle / "agent.toml").write_text(ODD_MANIFEST)
    faceoff(
        *("eval", bundle, "--no-sandbox", "--episodes", "3", "--seed", "5"),
        *("--task", "hit,defend", "--allow-faults", "--out", out),
    )
    return out


@cache
def game() -> Path:
    """A game of 1200 control steps between two agents that hold still."""
    out = folder() / "game"
    agent = ROOT / "agents" / "hold"
    faceoff("play", "--no-sandbox", agent, agent, "--steps", "1200", "--seed", "3", "--out", out)
    return out


def slice_of(dataset: Path, task: str, episode: int) -> list[dict[str, Any]]:
    """The control steps of an episode in the program's output, bit for bit."""
    lines = faceoff(
        *("dataset", "slice", dataset, "--task", task, "--episode", str(episode)),
        *("--format", "jsonl"),
    )
    return [json.loads(line) for line in lines.splitlines()]


def list_episodes(dataset: Path) -> list[dict[str, Any]]:
    """The episodes in the program's output."""
    return [json.loads(line) for line in faceoff("dataset", "list", dataset, "--json").splitlines()]
