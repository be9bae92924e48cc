"""The evaluator in this process gives the numbers of the binary's."""

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import faceoff
from commands import diverging
from faceoff import _native
from faceoff.gym import AirHockeyEnv

ROOT = Path(__file__).parents[3]
BINARY = Path(os.environ.get("FACEOFF_BIN", ROOT / "target" / "debug" / "faceoff"))


def hold(observation: np.ndarray) -> np.ndarray:
    """Stays where the arm is commanded to be."""
    return np.zeros(7)


class HoldFirst:
    """As agents/hold: what it saw first is its command, at rest."""

    def reset(self, task: str, episode: int) -> None:
        self.start: Any = None

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        if self.start is None:
            self.start = observation[6:13].copy()
        return np.stack([self.start, np.zeros(7)])


def test_results_have_what_a_result_file_has_but_for_time() -> None:
    result = faceoff.evaluate(hold, episodes=3, seed=5)
    assert list(result["tasks"]) == ["hit", "defend", "prepare"]
    for scored in result["tasks"].values():
        assert scored["episodes"] == 3
        assert scored["computation_time_s"] is None
        assert scored["violations"]["computation_time"] == 0
        assert scored["penalty_points"] == 0.0
    assert len(result["episodes"]) == 9
    assert result["tier"] == "deployable"
    assert result["profile"] == "evaluation"


def test_workers_change_nothing() -> None:
    alone = faceoff.evaluate(hold, tasks="defend", episodes=5, seed=2)
    assert faceoff.evaluate(hold, tasks="defend", episodes=5, seed=2, workers=2) == alone


def test_an_environment_and_the_evaluator_play_the_same_episodes() -> None:
    result = faceoff.evaluate(hold, tasks=["defend"], episodes=4, seed=11)
    env = AirHockeyEnv("defend", profile="evaluation")
    for episode in range(4):
        env.reset(seed=11 if episode == 0 else None)
        ended = False
        while not ended:
            *_, terminated, truncated, info = env.step(np.zeros(7))
            ended = terminated or truncated
        told = result["episodes"][episode]
        assert (told["end"], told["success"], told["steps"]) == (info["end"], info["success"], info["steps"])


def test_a_policy_for_each_task_is_told_when_an_episode_begins() -> None:
    class Counting:
        def __init__(self) -> None:
            self.told: list[tuple[str, int]] = []

        def reset(self, task: str, episode: int) -> None:
            self.told.append((task, episode))

        def __call__(self, observation: np.ndarray) -> np.ndarray:
            assert observation.dtype == np.float64
            assert observation.shape == ((23,) if self.told[-1][0] == "hit" else (20,))
            return np.zeros(7)

    one, other = Counting(), Counting()
    faceoff.evaluate({"hit": one, "defend": other}, tasks=["defend", "hit"], episodes=2)
    assert one.told == [("hit", 0), ("hit", 1)]
    assert other.told == [("defend", 0), ("defend", 1)]


def test_a_policy_that_makes_the_world_diverge_has_a_fault() -> None:
    played = iter(diverging()[1])
    result = faceoff.evaluate(
        lambda observation: next(played),
        tasks="prepare",
        episodes=1,
        profile="ideal",
        interpolation=None,
        action_mode="raw",
    )
    told = result["episodes"][0]
    assert told["end"] == "agent_fault"
    assert told["fault"]["kind"] == "diverged"
    assert not told["success"]
    assert result["tasks"]["prepare"]["violations"]["computation_time"] == 1


@pytest.mark.parametrize("profile", ["ideal", "evaluation"])
def test_the_binary_gives_the_same_numbers(profile: str, tmp_path: Path) -> None:
    assert BINARY.exists(), f"build it first: cargo build --workspace --bins ({BINARY})"
    command: list[str | Path] = [BINARY, "eval", ROOT / "agents" / "hold", "--no-sandbox"]
    command += ["--episodes", "6", "--seed", "17", "--profile", profile, "--out", tmp_path]
    subprocess.run(command, check=True, capture_output=True, cwd=tmp_path)
    theirs = json.loads((tmp_path / "results.json").read_text())
    ours = faceoff.evaluate(
        HoldFirst(), episodes=6, seed=17, profile=profile, interpolation=3, action_mode="raw"
    )
    del ours["episodes"]
    theirs.pop("timing", None)
    for scored in theirs["tasks"].values():
        # An agent answers late now and then, on a busy machine; a policy has no time.
        late = scored["violations"]["computation_time"]
        scored["computation_time_s"] = None
        scored["violations"]["computation_time"] = 0
        if late:
            scored["penalty_points"] = None
    for task, scored in ours["tasks"].items():
        if theirs["tasks"][task]["penalty_points"] is None:
            scored["penalty_points"] = None
    for result in (ours, theirs):
        if any(scored["penalty_points"] is None for scored in theirs["tasks"].values()):
            for whole in ("penalty_points", "tier"):
                result[whole] = None
            for scored in result["tasks"].values():
                scored["penalty_points"] = scored["tier"] = None
    assert ours == theirs


def test_a_course_that_has_ended_takes_no_answer() -> None:
    course = _native.Evaluation("ideal", "0", None, "{}").begin("defend", 0, 1, "delta", False)
    while course.answer(np.zeros(7)) is None:
        pass
    with pytest.raises(faceoff.OrderError, match="ended"):
        course.answer(np.zeros(7))
