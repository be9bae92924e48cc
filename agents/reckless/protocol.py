"""The protocol loop of an agent: one JSON object per line, in and out.

It needs only the standard library and no other file: `faceoff new` copies it into a bundle as `protocol.py`. An
agent is a class derived from `Agent`, and a call of `run`:

    from protocol import Agent, run

    class Hold(Agent):
        def reset(self):
            self.pose = None

        def act(self, observation):
            if self.pose is None:
                self.pose = self.joint_positions(observation)
            return [self.pose, [0.0] * 7]

    if __name__ == "__main__":
        run(Hold)

Lengths in m, angles in rad, times in s; positions in the base frame of the agent's own robot, so both sides of a game
see the table alike. Start-up and `reset` are not timed; an answer of `act` costs points from 20 ms on.
"""

from __future__ import annotations

import json
import math
import os
import sys
import traceback
from collections.abc import Iterable, Sequence
from typing import Any, BinaryIO

__all__ = ["Agent", "AgentError", "PROTOCOL", "SHAPES", "run"]

PROTOCOL = 1
"""The version of the protocol that this file implements."""

SHAPES: dict[int | None, tuple[int, ...]] = {
    1: (7,),
    2: (7,),
    3: (2, 7),
    4: (2, 7),
    5: (3, 7),
    -1: (2, 7),
    None: (20, 3, 7),
}
"""The shape of an action for each interpolation: positions (rad); then velocities (rad/s), accelerations (rad/s²)."""

LARGEST_NUMBER = 1e4
"""The evaluator refuses actions with numbers of a larger magnitude."""


class AgentError(Exception):
    """The evaluator would refuse the agent's answer; the message says what was expected and what came."""


class Agent:
    """A policy: everything between an observation and an action. Derive from it and write `act`.

    It is created once per process, after `hello`. Its state may carry over from one episode to the next.
    """

    interpolation: int | None = 3
    """The meaning of an action, a key of `SHAPES`; 3 is positions and velocities at the end of the step, cubic."""

    task: str
    """`hit`, `defend`, `prepare`, or `tournament` for a whole game."""
    agent_id: int
    """1 or 2: which robot of the table is the agent's own."""
    env: dict[str, Any]
    """Table, robot, limits and indices of an observation, as listed in the protocol's documentation."""

    def __init__(self, task: str, agent_id: int, env: dict[str, Any]) -> None:
        self.task, self.agent_id, self.env = task, agent_id, env
        self.start()

    def start(self) -> None:
        """Called once, when `task` and `env` are set: load networks and precompute tables here.

        Start-up may take 120 s and is not timed.
        """

    def reset(self) -> None:
        """Called before each episode, and before each rally of a game. At most 10 s."""

    def act(self, observation: list[float]) -> Any:
        """Called at each control step, 50 times per simulated second.

        `observation` has 20 numbers, 23 with an opponent on the table (`hit`, `tournament`). Returns an action
        of the shape of `interpolation` (`SHAPES`): lists, tuples or a NumPy array.
        """
        raise NotImplementedError(f"{type(self).__name__} has no act(self, observation)")

    @staticmethod
    def puck_state(observation: Sequence[float]) -> list[float]:
        """The puck's x, y (m), yaw (rad), and their rates (m/s, rad/s): 6 numbers."""
        return list(observation[0:6])

    @staticmethod
    def joint_positions(observation: Sequence[float]) -> list[float]:
        """The 7 joint angles, rad."""
        return list(observation[6:13])

    @staticmethod
    def joint_velocities(observation: Sequence[float]) -> list[float]:
        """The 7 joint velocities, rad/s, low-pass filtered."""
        return list(observation[13:20])

    @staticmethod
    def opponent_position(observation: Sequence[float]) -> list[float] | None:
        """x, y, z (m) of the opponent's mallet, or None without an opponent on the table."""
        return list(observation[20:23]) or None


def run(
    agent_class: type[Agent], requests: Iterable[bytes] | None = None, answers: BinaryIO | None = None
) -> None:
    """Runs an agent until `bye` or the end of the input.

    `requests` and `answers` default to standard input and output. Output of `print` goes to standard error, which
    is the agent's log. An exception is logged with its traceback, and sent in one line to the evaluator, which
    quotes it in the agent fault; the program ends with status 1.
    """
    lines: Iterable[bytes] = sys.stdin.buffer if requests is None else requests
    output: BinaryIO = _private_output() if answers is None else answers
    try:
        _answer_all(agent_class, lines, output)
    except BrokenPipeError:
        return  # the evaluator has closed the connection
    except Exception as error:
        traceback.print_exc()
        sys.stderr.flush()
        # Not a valid answer: the evaluator counts it as an agent fault and shows the line to the team.
        _write_answer(output, {"type": "error", "error": _summary(error)})
        sys.exit(1)


def _private_output() -> BinaryIO:
    """Reserves standard output for the protocol: any other output, even of C libraries, goes to the log."""
    sys.stdout.flush()
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    return answers


def _answer_all(agent_class: type[Agent], requests: Iterable[bytes], answers: BinaryIO) -> None:
    agent: Agent | None = None
    for line in requests:
        message = json.loads(line)
        kind = message["type"]
        if kind == "hello":
            if message["protocol"] != PROTOCOL:
                raise AgentError(f"expected protocol {PROTOCOL}, got {message['protocol']} from the evaluator")
            agent = agent_class(message["task"], message["agent_id"], message["env"])
            if agent.interpolation not in SHAPES:
                raise AgentError(f"interpolation: expected one of {list(SHAPES)}, got {agent.interpolation!r}")
            answer = {"type": "ready", "protocol": PROTOCOL, "interpolation": agent.interpolation}
        elif kind == "end":
            continue  # the episode is over; no answer is expected
        elif kind == "bye":
            return
        elif agent is None:
            raise AgentError(f"expected hello first, got {kind!r}")
        elif kind == "step":
            action = _check_action(agent.act(message["obs"]), agent.interpolation)
            answer = {"type": "act", "step": message["step"], "action": action}
        elif kind == "reset":
            agent.reset()
            answer = {"type": "ready", "episode": message["episode"]}
        else:
            raise AgentError(f"expected hello, reset, step, end or bye, got {kind!r}")
        _write_answer(answers, answer)


def _check_action(action: Any, interpolation: int | None) -> Any:
    """The action as nested lists of numbers, after a check of its shape."""
    if hasattr(action, "tolist"):
        action = action.tolist()  # NumPy, torch
    expected, got = SHAPES[interpolation], _shape(action)
    if got != expected:
        raise AgentError(
            f"act: expected an action of shape {list(expected)} for interpolation {interpolation}, "
            f"got {list(got) if got else type(action).__name__}"
        )
    return _numbers(action, "action")


def _shape(value: Any) -> tuple[int, ...]:
    """Lengths of nested lists, outermost first; without those of inner lists whose shapes differ."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if not isinstance(value, (list, tuple)):
        return ()
    inner = {_shape(element) for element in value}
    return (len(value), *(inner.pop() if len(inner) == 1 else ()))


def _numbers(value: Any, place: str) -> Any:
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [_numbers(element, f"{place}[{i}]") for i, element in enumerate(value)]
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise AgentError(f"act: {place}: expected a number, got {value!r}") from None
    if not math.isfinite(number) or abs(number) > LARGEST_NUMBER:
        raise AgentError(f"act: {place}: expected a number within ±{LARGEST_NUMBER:g}, got {number}")
    return number


def _summary(error: Exception) -> str:
    """Error and location in one line, short enough for the evaluator to quote it in full."""
    location = ""
    for frame in traceback.extract_tb(error.__traceback__):
        if frame.filename != __file__:
            location = f" ({os.path.basename(frame.filename)}, line {frame.lineno}, in {frame.name})"
    return f"{type(error).__name__}: {error}"[:200] + location


def _write_answer(answers: BinaryIO, answer: dict[str, Any]) -> None:
    answers.write(json.dumps(answer, allow_nan=False).encode() + b"\n")
    answers.flush()
