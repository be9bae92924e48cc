"""`faceoff.evaluate`, the evaluator in this process, has the same results as the program."""

import json
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import faceoff
import faceoff.dataset
from commands import diverging_actions
from faceoff import _native
from faceoff.gym import AirHockeyEnv

ROOT = Path(__file__).parents[3]
PROGRAM = Path(os.environ.get("FACEOFF_BIN", ROOT / "target" / "debug" / "faceoff"))


def hold(observation: np.ndarray) -> np.ndarray:
    """Keeps the commanded pose."""
    return np.zeros(7)


class HoldFirst:
    """The policy of agents/hold: commands the first observed pose, at rest."""

    def reset(self, task: str, episode: int) -> None:
        self.start: Any = None

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        if self.start is None:
            self.start = observation[6:13].copy()
        return np.stack([self.start, np.zeros(7)])


def test_results_equal_a_result_file_except_for_times() -> None:
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


def test_workers_do_not_change_results() -> None:
    expected = faceoff.evaluate(hold, tasks="defend", episodes=5, seed=2)
    assert faceoff.evaluate(hold, tasks="defend", episodes=5, seed=2, workers=2) == expected


def test_environment_and_evaluator_have_the_same_episodes() -> None:
    result = faceoff.evaluate(hold, tasks=["defend"], episodes=4, seed=11)
    env = AirHockeyEnv("defend", profile="evaluation")
    for episode in range(4):
        env.reset(seed=11 if episode == 0 else None)
        ended = False
        while not ended:
            *_, terminated, truncated, info = env.step(np.zeros(7))
            ended = terminated or truncated
        outcome = result["episodes"][episode]
        assert (outcome["end"], outcome["success"], outcome["steps"]) == (info["end"], info["success"], info["steps"])


def test_policies_are_reset_before_each_episode() -> None:
    class CountingPolicy:
        def __init__(self) -> None:
            self.resets: list[tuple[str, int]] = []

        def reset(self, task: str, episode: int) -> None:
            self.resets.append((task, episode))

        def __call__(self, observation: np.ndarray) -> np.ndarray:
            assert observation.dtype == np.float64
            assert observation.shape == ((23,) if self.resets[-1][0] == "hit" else (20,))
            return np.zeros(7)

    hit, defend = CountingPolicy(), CountingPolicy()
    faceoff.evaluate({"hit": hit, "defend": defend}, tasks=["defend", "hit"], episodes=2)
    assert hit.resets == [("hit", 0), ("hit", 1)]
    assert defend.resets == [("defend", 0), ("defend", 1)]


def test_diverging_policy_has_an_agent_fault() -> None:
    actions = iter(diverging_actions()[1])
    result = faceoff.evaluate(
        lambda observation: next(actions),
        tasks="prepare",
        episodes=1,
        profile="ideal",
        interpolation=None,
        action_mode="raw",
    )
    outcome = result["episodes"][0]
    assert outcome["end"] == "agent_fault"
    assert outcome["fault"]["kind"] == "diverged"
    assert not outcome["success"]
    assert result["tasks"]["prepare"]["violations"]["computation_time"] == 1


@pytest.mark.parametrize("profile", ["ideal", "evaluation"])
def test_program_gives_the_same_numbers(profile: str, tmp_path: Path) -> None:
    assert PROGRAM.exists(), f"build it first: cargo build --workspace --bins ({PROGRAM})"
    command: list[str | Path] = [PROGRAM, "eval", ROOT / "agents" / "hold", "--no-sandbox"]
    command += ["--episodes", "6", "--seed", "17", "--profile", profile, "--out", tmp_path]
    subprocess.run(command, check=True, capture_output=True, timeout=600, cwd=tmp_path)
    from_program = json.loads((tmp_path / "results.json").read_text())
    from_package = faceoff.evaluate(
        HoldFirst(), episodes=6, seed=17, profile=profile, interpolation=3, action_mode="raw"
    )
    del from_package["episodes"]
    from_program.pop("timing", None)
    for scored in from_program["tasks"].values():
        # On a busy machine an agent's answers may be late; a policy's time is not measured.
        late = scored["violations"]["computation_time"]
        scored["computation_time_s"] = None
        scored["violations"]["computation_time"] = 0
        if late:
            scored["penalty_points"] = None
    for task, scored in from_package["tasks"].items():
        if from_program["tasks"][task]["penalty_points"] is None:
            scored["penalty_points"] = None
    for result in (from_package, from_program):
        if any(scored["penalty_points"] is None for scored in from_program["tasks"].values()):
            for key in ("penalty_points", "tier"):
                result[key] = None
            for scored in result["tasks"].values():
                scored["penalty_points"] = scored["tier"] = None
    assert from_package == from_program


def test_dataset_has_the_seed_of_its_robot(tmp_path: Path) -> None:
    command: list[str | Path] = [PROGRAM, "eval", ROOT / "agents" / "hold", "--no-sandbox", "--task", "defend"]
    command += ["--episodes", "4", "--seed", "17", "--mismatch-seed", "9", "--out", tmp_path]
    subprocess.run(command, check=True, capture_output=True, timeout=600, cwd=tmp_path)
    dataset = faceoff.dataset.open(tmp_path)
    actions = [dataset.episode("defend", episode).to_numpy().actions for episode in range(4)]

    class RecordedPolicy:
        def reset(self, task: str, episode: int) -> None:
            self.actions = iter(actions[episode])

        def __call__(self, observation: np.ndarray) -> np.ndarray:
            seen.append(observation)
            return next(self.actions)

    def observations(mismatch_seed: str | None) -> list[np.ndarray]:
        seen.clear()
        faceoff.evaluate(
            RecordedPolicy(), tasks="defend", episodes=4, seed=17, mismatch_seed=mismatch_seed, interpolation=3,
            action_mode="raw",
        )
        return list(seen)

    seen: list[np.ndarray] = []
    recorded = [row for episode in range(4) for row in dataset.episode("defend", episode).to_numpy().observations[:-1]]
    np.testing.assert_array_equal(observations(dataset.mismatch_seed), recorded)
    assert not np.array_equal(np.array(observations(None)[:50]), np.array(recorded[:50]))


def test_ended_episode_refuses_an_answer() -> None:
    episode = _native.Evaluation("ideal", "0", None, "{}").begin("defend", 0, 1, "delta", False)
    while episode.answer(np.zeros(7)) is None:
        pass
    with pytest.raises(faceoff.OrderError, match="ended"):
        episode.answer(np.zeros(7))


# --- workers -----------------------------------------------------------------------------------------------------

SCRIPT = """
import json, sys
import faceoff
{before}
{policy}
result = faceoff.evaluate(policy, tasks="defend", episodes=3, seed=5, workers=2)
print(json.dumps([outcome["steps"] for outcome in result["episodes"]]))
"""
POLICIES = {
    "lambda": "policy = lambda observation: [0.0] * 7",
    "local class": """
def make():
    class Policy:
        def __call__(self, observation):
            return [0.0] * 7
    return Policy()
policy = make()""",
    "function that prints": """
def policy(observation):
    print("a policy may print")
    return [0.0] * 7""",
}


@pytest.mark.parametrize("policy", POLICIES.values(), ids=POLICIES)
@pytest.mark.parametrize("source", ["file", "standard input"])
def test_workers_play_policies_defined_anywhere(policy: str, source: str, tmp_path: Path) -> None:
    """The script has no `if __name__ == "__main__"`."""
    script = SCRIPT.format(before="", policy=policy)
    file = tmp_path / "script.py"
    file.write_text(script)
    command = [sys.executable, *([file] if source == "file" else ["-"])]
    done = subprocess.run(command, input=script, capture_output=True, timeout=600, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    expected = faceoff.evaluate(lambda observation: np.zeros(7), tasks="defend", episodes=3, seed=5)
    assert json.loads(done.stdout) == [outcome["steps"] for outcome in expected["episodes"]]


def test_without_cloudpickle_the_error_says_what_to_do(tmp_path: Path) -> None:
    script = SCRIPT.format(before="sys.modules['cloudpickle'] = None", policy=POLICIES["lambda"])
    done = subprocess.run([sys.executable, "-"], input=script, capture_output=True, timeout=600, text=True, cwd=tmp_path)
    assert "faceoff.errors.ArgumentTypeError: policy: expected one" in done.stderr
    assert "pip install cloudpickle" in done.stderr
    assert "workers=1" in done.stderr


def test_exception_of_a_policy_in_a_worker_is_raised() -> None:
    def policy(observation: np.ndarray) -> np.ndarray:
        raise LookupError("no such thing")

    with pytest.raises(LookupError, match="no such thing") as raised:
        faceoff.evaluate(policy, tasks="defend", episodes=2, workers=2)
    assert "in policy" in str(raised.value.__cause__)


def test_death_of_a_worker_is_an_error() -> None:
    def policy(observation: np.ndarray) -> np.ndarray:
        os._exit(7)

    with pytest.raises(faceoff.Error, match="workers: expected a result .* ended with status 7"):
        faceoff.evaluate(policy, tasks="defend", episodes=2, workers=2)


def test_error_in_one_worker_ends_the_others(tmp_path: Path) -> None:
    """The first worker would never end."""
    path = str(tmp_path / "process")

    class Policy:
        def reset(self, task: str, episode: int) -> None:
            if episode == 0:
                Path(path).write_text(str(os.getpid()))
                threading.Event().wait()
            while not Path(path).exists():
                pass
            raise LookupError("no such thing")

        def __call__(self, observation: np.ndarray) -> np.ndarray:
            return np.zeros(7)

    with pytest.raises(LookupError, match="no such thing"):
        faceoff.evaluate(Policy(), tasks="defend", episodes=2, workers=2)
    with pytest.raises(ProcessLookupError):
        os.kill(int(Path(path).read_text()), 0)


def test_workers_end_with_the_process_that_started_them(tmp_path: Path) -> None:
    script = """
import os, pathlib, threading
import faceoff
def policy(observation):
    pathlib.Path(f"worker-{os.getpid()}").touch()
    threading.Event().wait()
threading.Timer(0.0, lambda: None).start()
faceoff.evaluate(policy, tasks="defend", episodes=2, workers=2)
"""
    parent = subprocess.Popen([sys.executable, "-c", script], cwd=tmp_path)
    while len(workers := list(tmp_path.glob("worker-*"))) < 2:
        assert parent.poll() is None
    parent.kill()
    parent.wait()
    for worker in workers:
        # They have no parent that waits for them, so they disappear when they end.
        while Path(f"/proc/{worker.name.removeprefix('worker-')}").exists():
            state = Path(f"/proc/{worker.name.removeprefix('worker-')}/stat")
            if state.exists() and ") Z " in state.read_text(errors="replace"):
                break


def test_exceptions_of_a_script_are_raised_as_they_are(tmp_path: Path) -> None:
    script = """
import faceoff
class OwnError(Exception): ...
def policy(observation):
    raise OwnError("own")
try:
    faceoff.evaluate(policy, tasks="defend", episodes=2, workers=2)
except OwnError as error:
    print("caught", error)
"""
    (tmp_path / "struct.py").write_text("raise SystemError('a file of the current folder')")
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "script.py").write_text(script)
    command = [sys.executable, "sub/script.py"]
    done = subprocess.run(command, capture_output=True, timeout=600, text=True, cwd=tmp_path)
    assert done.stdout == "caught own\n", done.stderr


def test_policy_that_cannot_be_sent_is_refused() -> None:
    lock = threading.Lock()
    with pytest.raises(faceoff.ArgumentTypeError, match="policy: expected one that can be sent to other processes"):
        faceoff.evaluate(lambda observation: lock, tasks="defend", episodes=2, workers=2)
