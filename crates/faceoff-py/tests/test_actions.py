"""`faceoff.actions` gives agents the environments' observations and commands, bit for bit."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import faceoff
from faceoff import actions, agent
from faceoff.actions import ACTION_MODES, OBSERVATION_BOUNDS, ActionFormat, environment_observation
from faceoff.gym import AirHockeyEnv
from faceoff.kinematics import model

INTERPOLATIONS = (1, 2, 3, 4, 5, -1, None)


def test_constants_are_those_of_the_model() -> None:
    for name in ("START_Q", "POSITION_LIMIT_RAD", "VELOCITY_LIMIT_RAD_S", "LIMIT_FRACTION", "CONTROL_STEP_S", "SUBSTEPS"):
        assert getattr(actions, name) == getattr(model, name), name
    accelerations = [actions.ACCELERATION_PER_VELOCITY * limit for limit in actions.VELOCITY_LIMIT_RAD_S]
    assert accelerations == list(model.ACCELERATION_LIMIT_RAD_S2)


def test_observation_bounds_are_those_of_the_space() -> None:
    space = AirHockeyEnv("hit").observation_space
    assert space.low.tolist() == [low for low, _ in OBSERVATION_BOUNDS]  # type: ignore[attr-defined]
    assert space.high.tolist() == [high for _, high in OBSERVATION_BOUNDS]  # type: ignore[attr-defined]


@pytest.mark.parametrize("clip", [False, True])
@pytest.mark.parametrize("mode", ACTION_MODES)
@pytest.mark.parametrize("interpolation", INTERPOLATIONS)
def test_commands_move_the_arm_as_the_environment_does(interpolation: int | None, mode: Any, clip: bool) -> None:
    """One environment gets the actions, another one in raw mode the commands made of them, over whole episodes."""
    own = AirHockeyEnv("defend", interpolation=interpolation, action_mode=mode, clip_actions=clip, profile="evaluation")
    raw = AirHockeyEnv("defend", interpolation=interpolation, action_mode="raw", profile="evaluation")
    converter = ActionFormat(mode, interpolation, clip)
    assert converter.length == own.action_space.shape[0]  # type: ignore[index]
    draws = np.random.default_rng(0)
    largest = 0.1 if mode == "raw" else 1.0
    for episode in range(2):
        options = {"episode": episode}
        seed = 5 if episode == 0 else None
        first, _ = own.reset(seed=seed, options=options)
        second, _ = raw.reset(seed=seed, options=options)
        assert (first == second).all()
        converter.restart()
        # A drift brings positions to their bounds.
        drift = draws.uniform(-1.0, 1.0, converter.length)
        ended = False
        while not ended:
            action = np.clip(drift + draws.uniform(-1.0, 1.0, converter.length), -1.0, 1.0).astype(np.float32) * largest
            if clip and mode != "raw":
                action *= 3.0
            command = converter.command(action)
            assert agent._shape(command) == agent.SHAPES[interpolation]
            first, *_, terminated, truncated, info = own.step(action)
            second, *_ = raw.step(np.array(command).reshape(-1))
            assert (first == second).all()
            assert (own.state.array == raw.state.array).all()
            ended = terminated or truncated
        assert info["steps"] > 1


@pytest.mark.parametrize("task", ["hit", "defend", "prepare"])
def test_observation_equals_that_of_the_environment(task: Any) -> None:
    """The evaluator's observations, in double precision, become those of the environment for the same episode."""
    env = AirHockeyEnv(task, profile="evaluation")
    moves = np.random.default_rng(1).uniform(-1.0, 1.0, (500, 7))
    seen: list[list[list[float]]] = []

    class Recorder:
        def reset(self, task: str, episode: int) -> None:
            seen.append([])

        def __call__(self, observation: np.ndarray) -> np.ndarray:
            seen[-1].append(environment_observation(observation))
            return moves[len(seen[-1]) - 1]

    faceoff.evaluate(Recorder(), tasks=task, episodes=3, seed=2)
    for number, observations in enumerate(seen):
        observation, _ = env.reset(seed=2, options={"episode": number})
        for step, converted in enumerate(observations):
            assert converted == observation.tolist()
            assert np.array(converted, np.float32).tolist() == converted
            observation, *_ = env.step(moves[step])


def test_observation_beyond_the_bounds_is_clipped() -> None:
    for sign in (-1.0, 1.0):
        extreme = environment_observation([sign * 1e300] * 23)
        assert extreme == [bounds[0 if sign < 0 else 1] for bounds in OBSERVATION_BOUNDS]


def test_nested_actions_give_the_same_command() -> None:
    flat = [0.01 * i for i in range(14)]
    expected = ActionFormat("delta", 3).command(flat)
    for action in (np.array(flat), np.array(flat).reshape(2, 7), [flat[:7], tuple(flat[7:])]):
        assert ActionFormat("delta", 3).command(action) == expected


def test_command_does_not_share_the_converter_state() -> None:
    converter = ActionFormat("delta", 3)
    command = converter.command([0.0] * 14)
    command[0][0] = 9.0
    assert converter.commanded == list(model.START_Q)


BAD_CALLS: list[tuple[Any, str]] = [
    (lambda: ActionFormat("torque"), "action_mode: expected one of delta, absolute, raw, got 'torque'"),
    (lambda: ActionFormat(3), "action_mode: expected one of"),
    (lambda: ActionFormat(["delta"]), "action_mode: expected one of"),
    (lambda: ActionFormat("delta", 0), "interpolation: expected 1, 2, 3, 4, 5, -1 or None, got 0"),
    (lambda: ActionFormat("delta", True), "interpolation: expected"),
    (lambda: ActionFormat("delta", 3.0), "interpolation: expected"),
    (lambda: ActionFormat("delta", "3"), "interpolation: expected"),
    (lambda: ActionFormat("delta", [3]), "interpolation: expected"),
    (lambda: ActionFormat().command([0.0] * 6), "action: expected 7 numbers for interpolation 1, got 6"),
    (lambda: ActionFormat().command([0.0] * 6 + [1.5]), "expected numbers from -1 to 1, got 1.5 at index 6; clip it"),
    (lambda: ActionFormat("raw").command([0.0] * 6 + [-1e5]), "expected numbers from -10000 to 10000, got -100000.0"),
    (lambda: ActionFormat("raw", clip_actions=True).command([float("nan")] * 7), "expected finite numbers, got nan"),
    (lambda: ActionFormat().command("seven"), "action: expected numbers in a list or an array, got 'seven'"),
    (lambda: ActionFormat().command(None), "action: expected numbers"),
    (lambda: environment_observation([0.0] * 21), "observation: expected 20 or 23 numbers, got 21"),
    (lambda: environment_observation([0.0] * 19 + [float("inf")]), "observation: expected finite numbers, got inf"),
    (lambda: environment_observation([None] * 20), "observation: expected numbers"),  # type: ignore[list-item]
]


@pytest.mark.parametrize(("call", "message"), BAD_CALLS)
def test_bad_input_says_what_came_and_what_was_expected(call: Any, message: str) -> None:
    with pytest.raises(faceoff.Error) as caught:
        call()
    assert message in str(caught.value)


def test_file_works_alone_with_the_standard_library(tmp_path: Path) -> None:
    (tmp_path / "actions.py").write_bytes(Path(actions.__file__).read_bytes())
    program = (
        "import sys; sys.path[0:0] = ['.']\n"
        "from actions import ActionFormat, environment_observation\n"
        "print(ActionFormat('absolute', 3).command([0.0] * 14))\n"
        "try:\n    environment_observation([0.0])\n"
        "except ValueError as error:\n    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    command, error = done.stdout.splitlines()
    assert command == str([list(model.START_Q), [0.0] * 7])
    assert error == "observation: expected 20 or 23 numbers, got 1"


def test_agent_of_the_python_page_runs(tmp_path: Path) -> None:
    """The program in docs/python.md, beside the two files that it names."""
    root = Path(__file__).resolve().parents[3]
    text = (root / "docs" / "python.md").read_text().split("### Write an agent")[1]
    [program] = re.findall(r"^```python\n(from actions .*?)^```", text, re.DOTALL | re.MULTILINE)
    (tmp_path / "actions.py").write_bytes(Path(actions.__file__).read_bytes())
    (tmp_path / "protocol.py").write_bytes(Path(agent.__file__).read_bytes())
    (tmp_path / "agent.py").write_text("my_policy = lambda observation: [1.0] * 7\n" + program)
    observation = [0.0] * 20
    messages: list[dict[str, Any]] = [
        {"type": "hello", "protocol": 1, "task": "defend", "agent_id": 1, "env": {}},
        {"type": "reset", "episode": 0},
        {"type": "step", "step": 0, "obs": observation},
        {"type": "step", "step": 1, "obs": observation},
        {"type": "bye"},
    ]
    lines = "".join(json.dumps(message) + "\n" for message in messages)
    command = [sys.executable, "-I", "-S", "-c", "import sys; sys.path[0:0] = ['.']; import agent"]
    done = subprocess.run(command, cwd=tmp_path, input=lines, capture_output=True, text=True, check=True)
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    expected = ActionFormat()
    assert [answer.get("action") for answer in answers[2:]] == [expected.command([1.0] * 7) for _ in range(2)]
