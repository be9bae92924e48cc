"""A policy of Stable-Baselines3 goes from the training to the board by the commands of docs/from-sb3.md."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import faceoff
import pytest
from board_server import BoardServer
from faceoff.dataset import open_dataset
from policies import PROGRAM, ROOT, Policy, configuration, played, sb3_action
from stable_baselines3 import PPO

sys.path.insert(0, str(ROOT / "agents" / "examples"))

import sb3_defend  # noqa: E402

PAGE = ROOT / "docs" / "from-sb3.md"
EPISODES = 400
#: Success of an arm that holds still in these episodes, percent: agents/examples/trained/ppo/log.txt.
HOLD_PERCENT = 22.0
#: Score of a success rate of 1 in `defend` alone.
POINTS_OF_DEFEND = 40.0


def command_of_the_page(first: str) -> list[str]:
    """The arguments of the page's command that begins so."""
    [line] = [line for line in re.findall(r"^```sh\n(.*?)^```", PAGE.read_text(), re.DOTALL | re.MULTILINE) if line.startswith(first)]
    return shlex.split(line)


@pytest.fixture(scope="module")
def training(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The agent's folder, and what the training printed."""
    folder = tmp_path_factory.mktemp("training")
    program, script, agent = command_of_the_page("python ")
    assert program == "python"
    # For a test of this file in less time; the success rate is then too low.
    shorter = shlex.split(os.environ.get("FACEOFF_SB3_ARGUMENTS", ""))
    done = subprocess.run([sys.executable, ROOT / script, agent, *shorter], cwd=folder, stdout=subprocess.PIPE, text=True)
    assert done.returncode == 0
    return folder / agent, done.stdout


@pytest.fixture(scope="module")
def own_percent(training: tuple[Path, str]) -> float:
    """The success rate that Stable-Baselines3 measured."""
    return 100.0 * float(re.findall(r"^success rate ([0-9.]+) of", training[1], re.MULTILINE)[0])


def test_policy_beats_holding_by_30_percentage_points(own_percent: float) -> None:
    assert own_percent >= HOLD_PERCENT + 30.0


def test_agent_scores_within_2_points_of_the_policy(training: tuple[Path, str], own_percent: float, tmp_path: Path) -> None:
    _, command, _, *options = command_of_the_page("faceoff eval")
    assert [command, *options] == ["eval", "--task", "defend", "--episodes", str(EPISODES)]
    result = played(training[0], "defend", EPISODES, tmp_path)
    assert abs(result["success_rate"] - own_percent / 100.0) * POINTS_OF_DEFEND <= 2.0
    assert not any(count for name, count in result["violations"].items() if name != "computation_time")


def test_board_scores_within_2_points_of_the_policy(training: tuple[Path, str], tmp_path: Path) -> None:
    """The policy in this process plays the same episodes: the team's dataset contains the server's secret seeds."""
    assert command_of_the_page("faceoff submit")[1:] == ["submit", training[0].name]
    server = BoardServer(PROGRAM, tmp_path, configuration(), EPISODES)
    try:
        evaluation = server.score(training[0])
        dataset = server.dataset(evaluation, tmp_path / "dataset.zip")
    finally:
        server.stop()
    result = evaluation["result"]
    model: Any = PPO.load(training[0].with_suffix(".zip"), env=sb3_defend.make_worlds(1, seed=0), device="cpu")
    policy = Policy(sb3_action(model), sb3_defend.MALLET_SPEED_M_S, sb3_defend.FRAMES)
    expected = faceoff.evaluate(
        policy,
        tasks="defend",
        episodes=EPISODES,
        seed=result["seed"],
        mismatch_seed=open_dataset(dataset).manifest["mismatch_seed"],
        interpolation=3,
        action_mode="raw",
    )
    assert abs(result["score"] - expected["score"]) <= 2.0

