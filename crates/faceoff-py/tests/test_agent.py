"""The loop of `faceoff.agent`, which exchanges messages with the evaluator, as a library in this process and as a program over pipes."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from faceoff.agent import SHAPES, Agent, run

AGENT_FILE = Path(__file__).parents[1] / "python" / "faceoff" / "agent.py"

POSE = [0.0, -0.1961, 0.0, -1.8436, 0.0, 0.9704, 0.0]
OBSERVATION = [1.0, 0.1, 0.2, -1.0, -0.1, -0.2, *POSE, *[0.5] * 7]
HELLO = {"type": "hello", "protocol": 1, "task": "defend", "agent_id": 2, "env": {"dt": 0.02}}
RESET = {"type": "reset", "episode": 17}
STEP = {"type": "step", "step": 0, "obs": OBSERVATION}


class Hold(Agent):
    def act(self, observation: list[float]) -> Any:
        return [self.joint_positions(observation), [0.0] * 7]


def lines(*messages: dict[str, Any]) -> list[bytes]:
    """Messages as the lines that an agent reads."""
    return [json.dumps(message).encode() + b"\n" for message in messages]


def answers_of(agent: type[Agent], *messages: dict[str, Any]) -> list[dict[str, Any]]:
    """What an agent answers to these messages."""
    output = io.BytesIO()
    run(agent, lines(*messages), output)
    return [json.loads(line) for line in output.getvalue().splitlines()]


def error_of(agent: type[Agent], *messages: dict[str, Any]) -> str:
    """The error message that a failing agent sends; the program must end with status 1."""
    output = io.BytesIO()
    with pytest.raises(SystemExit) as ended:
        run(agent, lines(*messages), output)
    assert ended.value.code == 1
    last = json.loads(output.getvalue().splitlines()[-1])
    assert last["type"] == "error"
    text = last["error"]
    assert isinstance(text, str)
    return text


def constant_agent(action: Any, code: int | None = 3) -> type[Agent]:
    """An agent that always answers with this action, of the interpolation `code`."""
    class ConstantAgent(Agent):
        interpolation = code

        def act(self, observation: list[float]) -> Any:
            return action

    return ConstantAgent


def test_conversation_runs_from_hello_to_bye() -> None:
    end = {"type": "end", "episode": 17, "steps": 1}
    sent = answers_of(Hold, HELLO, RESET, STEP, end, RESET, STEP, {"type": "bye"}, STEP)
    ready = {"type": "ready", "episode": 17}
    act = {"type": "act", "step": 0, "action": [POSE, [0.0] * 7]}
    assert sent == [{"type": "ready", "protocol": 1, "interpolation": 3}, ready, act, ready, act]


def test_agent_has_task_id_and_env_in_start() -> None:
    class Probe(Hold):
        def start(self) -> None:
            assert (self.task, self.agent_id, self.env) == ("defend", 2, {"dt": 0.02})

    assert len(answers_of(Probe, HELLO, RESET)) == 2


def test_observation_accessors_return_their_parts() -> None:
    agent = Hold("hit", 1, {})
    assert agent.puck_state(OBSERVATION) == [1.0, 0.1, 0.2, -1.0, -0.1, -0.2]
    assert agent.joint_positions(OBSERVATION) == POSE
    assert agent.joint_velocities(OBSERVATION) == [0.5] * 7
    assert agent.opponent_position(OBSERVATION) is None
    assert agent.opponent_position([*OBSERVATION, 2.4, 0.1, 0.16]) == [2.4, 0.1, 0.16]


@pytest.mark.parametrize("code", SHAPES)
def test_interpolations_accept_actions_of_their_shape(code: int | None) -> None:
    action: Any = 0.5
    for length in reversed(SHAPES[code]):
        action = [action] * length
    sent = answers_of(constant_agent(action, code), HELLO, RESET, STEP)
    assert sent[0]["interpolation"] == code
    assert sent[2]["action"] == action


def test_arrays_are_accepted_as_actions() -> None:
    numpy = pytest.importorskip("numpy")
    whole = numpy.arange(14, dtype=numpy.float32).reshape(2, 7)
    mixed = [numpy.arange(7), [numpy.float64(7 + i) for i in range(7)]]
    for action in (whole, mixed, tuple(whole)):
        sent = answers_of(constant_agent(action), HELLO, RESET, STEP)
        assert sent[2]["action"] == whole.tolist()


@pytest.mark.parametrize(
    ("action", "message"),
    [
        ([0.0] * 14, "expected an action of shape [2, 7] for interpolation 3, got [14]"),
        ([[0.0] * 7, [0.0] * 6], "got [2]"),
        (None, "got NoneType"),
        ([[0.0] * 7, [0.0] * 6 + [float("nan")]], "action[1][6]: expected a number within ±10000, got nan"),
        ([[0.0] * 7, [1e5] + [0.0] * 6], "action[1][0]: expected a number within ±10000, got 100000.0"),
        ([[0.0] * 7, [0.0] * 6 + ["x"]], "action[1][6]: expected a number, got 'x'"),
    ],
)
def test_invalid_action_error_says_expected_and_got(action: Any, message: str) -> None:
    assert message in error_of(constant_agent(action), HELLO, RESET, STEP)


def test_exception_reaches_log_and_evaluator(capfd: pytest.CaptureFixture[str]) -> None:
    class Broken(Hold):
        def act(self, observation: list[float]) -> Any:
            return 1 / 0

    message = error_of(Broken, HELLO, RESET, STEP)
    assert message.startswith("ZeroDivisionError: division by zero (test_agent.py, line ")
    assert message.endswith(", in act)")
    log = capfd.readouterr().err
    assert "Traceback" in log and "return 1 / 0" in log


def test_invalid_messages_end_with_an_error() -> None:
    assert "no act(self, observation)" in error_of(Agent, HELLO, RESET, STEP)
    assert "expected hello first, got 'reset'" in error_of(Hold, RESET)
    assert "expected hello, reset, step, end or bye, got 'dance'" in error_of(Hold, HELLO, {"type": "dance"})
    assert "expected protocol 1, got 2 from the evaluator" in error_of(Hold, {**HELLO, "protocol": 2})
    assert "interpolation: expected one of" in error_of(constant_agent([], 7), HELLO)


def test_print_goes_to_the_log_instead_of_the_evaluator(tmp_path: Path) -> None:
    """Output of C libraries, which do not use sys.stdout, is redirected, too."""
    (tmp_path / "protocol.py").write_bytes(AGENT_FILE.read_bytes())
    (tmp_path / "agent.py").write_text(
        "import os\n"
        "from protocol import Agent, run\n"
        "class Chatty(Agent):\n"
        "    def act(self, observation):\n"
        "        print('thinking')\n"
        "        os.write(1, b'deep thought\\n')\n"
        "        return [[0.0] * 7] * 2\n"
        "run(Chatty)\n"
    )
    # Without site packages: the file needs nothing else.
    command = [sys.executable, "-I", "-S", "-c", "import sys; sys.path[0:0] = ['.']; import agent"]
    ended = subprocess.run(
        command, cwd=tmp_path, input=b"".join(lines(HELLO, RESET, STEP)), capture_output=True, check=True
    )
    kinds = [json.loads(line)["type"] for line in ended.stdout.splitlines()]
    assert kinds == ["ready", "ready", "act"]
    assert b"thinking" in ended.stderr and b"deep thought" in ended.stderr


