"""The environments' actions and observations, for agents: the same numbers, bit for bit.

A policy that was trained in an environment of `faceoff.gym` gets its observations in single precision and answers in
the environment's action mode. An agent gets observations in double precision and sends joint commands in rad. This file
converts between them with the standard library alone, and needs no other file: copy it into a bundle beside the
protocol loop.

    from actions import ActionFormat, environment_observation
    from protocol import Agent, run

    class Trained(Agent):
        interpolation = 1

        def start(self):
            self.actions = ActionFormat("delta", interpolation=1)

        def reset(self):
            self.actions.restart()

        def act(self, observation):
            return self.actions.command(policy(environment_observation(observation)))
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from faceoff.errors import ArgumentError, ArgumentTypeError
else:
    try:
        from faceoff.errors import ArgumentError, ArgumentTypeError
    except ImportError:
        # This file was copied without the package.
        ArgumentError, ArgumentTypeError = ValueError, TypeError

__all__ = ["ACTION_MODES", "ActionFormat", "OBSERVATION_BOUNDS", "environment_observation"]

ACTION_MODES = ("delta", "absolute", "raw")
"""Meanings of an action's numbers."""

JOINTS = 7
SUBSTEPS = 20
CONTROL_STEP_S = 0.02
# The numbers of the simulator's model; a test compares them with `faceoff.kinematics.model`.
START_Q = (0.0, -0.196067345, 0.0, -1.84363898, 0.0, 0.970422238, 0.0)
POSITION_LIMIT_RAD = (2.96706, 2.0944, 2.96706, 2.0944, 2.96706, 2.0944, 3.05433)
VELOCITY_LIMIT_RAD_S = tuple(limit * (math.pi / 180.0) for limit in (85.0, 85.0, 100.0, 75.0, 130.0, 135.0, 135.0))
# Acceleration limits are this many times the velocity limits, 1/s.
ACCELERATION_PER_VELOCITY = 10.0
# The rules allow this share of the limits of positions and velocities.
LIMIT_FRACTION = 0.95
# The evaluator refuses larger magnitudes.
LARGEST_NUMBER = 1e4

# Rows of 7 numbers for each interpolation, and the shape of a command in the protocol.
_ROWS: dict[int | None, int] = {1: 1, 2: 1, 3: 2, 4: 2, 5: 3, -1: 2, None: 3 * SUBSTEPS}


def _single(value: float) -> float:
    """The value rounded to single precision."""
    rounded: float = struct.unpack("<f", struct.pack("<f", value))[0]
    return rounded


def _bounds() -> tuple[tuple[float, float], ...]:
    """Bounds of each number of an observation. x and y: the table with a margin of 1 m; q: 0.2 rad beyond the limits;
    joint velocities: three times their limits; z: of the opponent's end effector."""
    x, y, z = (-0.464, 3.484), (-1.519, 1.519), (0.0, 2.17)
    puck = (x, y, (-math.pi, math.pi), (-20.0, 20.0), (-20.0, 20.0), (-500.0, 500.0))
    q = tuple((-limit - 0.2, limit + 0.2) for limit in POSITION_LIMIT_RAD)
    dq = tuple((-3.0 * limit, 3.0 * limit) for limit in VELOCITY_LIMIT_RAD_S)
    return tuple((_single(low), _single(high)) for low, high in (*puck, *q, *dq, x, y, z))


OBSERVATION_BOUNDS = _bounds()
"""Lowest and highest value of each of the 23 numbers of an observation; the first 20 without an opponent."""


def environment_observation(observation: Sequence[float]) -> list[float]:
    """The observation of an environment: 20 or 23 numbers in single precision, within `OBSERVATION_BOUNDS`.

    `observation` is the protocol's, in double precision: a list or an array of 20 or 23 numbers. The result converts to
    `float32` without rounding.
    """
    values = [float(value) for value in _flatten(observation, "observation")]
    if len(values) not in (20, 23):
        raise ArgumentError(f"observation: expected 20 or 23 numbers, got {len(values)}")
    for index, value in enumerate(values):
        if not math.isfinite(value):
            raise ArgumentError(f"observation: expected finite numbers, got {value} at index {index}")
    # Bounds are single-precision numbers, so the order of clipping and rounding does not matter.
    return [_single(min(max(value, low), high)) for value, (low, high) in zip(values, OBSERVATION_BOUNDS)]


class ActionFormat:
    """Converts a policy's actions to the commands that an agent sends, as the environments do.

    Arguments have the names and meanings of the environments': `action_mode` is `delta`, `absolute` or `raw`;
    `interpolation` is 1 to 5, -1 or None; `clip_actions` clips numbers that are too large instead of refusing them.
    One object converts the actions of one robot: it keeps the last commanded position, from which `delta` counts.
    """

    def __init__(
        self, action_mode: str = "delta", interpolation: int | None = 1, clip_actions: bool = False
    ) -> None:
        if action_mode not in ACTION_MODES:
            raise ArgumentError(f"action_mode: expected one of {', '.join(ACTION_MODES)}, got {action_mode!r}")
        is_code = interpolation is None or (isinstance(interpolation, int) and not isinstance(interpolation, bool))
        if not is_code or interpolation not in _ROWS:
            raise ArgumentError(f"interpolation: expected 1, 2, 3, 4, 5, -1 or None, got {interpolation!r}")
        self.action_mode = action_mode
        self.interpolation = interpolation
        self.clip_actions = bool(clip_actions)
        self.rows = _ROWS[interpolation]
        """Rows of 7 numbers in an action."""
        self.commanded = list(START_Q)
        """The last commanded joint positions, rad."""

    @property
    def length(self) -> int:
        """Count of numbers in an action."""
        return JOINTS * self.rows

    def restart(self) -> None:
        """Begins an episode, or a rally of a game: the arm is in its start pose."""
        self.commanded = list(START_Q)

    def command(self, action: Any) -> list[Any]:
        """The action as the protocol has it: nested lists of the shape for `interpolation`, rad, rad/s and rad/s².

        `action` has `length` numbers, in a list, in nested lists or in an array of any shape.
        """
        numbers = self._checked(action)
        previous = self.commanded
        rows = []
        for row in range(self.rows):
            values = numbers[JOINTS * row : JOINTS * (row + 1)]
            if self.interpolation is None:
                quantity, part = row % 3, (row // 3 + 1) / SUBSTEPS
            else:
                quantity, part = row, 1.0
            if self.action_mode != "raw":
                values = [self._scale(quantity, part, joint, values[joint], previous) for joint in range(JOINTS)]
            if quantity == 0:
                self.commanded = list(values)
            rows.append(values)
        if self.rows == 1:
            return rows[0]
        if self.interpolation is None:
            return [rows[3 * substep : 3 * substep + 3] for substep in range(SUBSTEPS)]
        return rows

    def _checked(self, action: Any) -> list[float]:
        """The action's numbers within their bounds, clipped or refused."""
        numbers = _flatten(action, "action")
        if len(numbers) != self.length:
            raise ArgumentError(
                f"action: expected {self.length} numbers for interpolation {self.interpolation}, got {len(numbers)}"
            )
        limit = LARGEST_NUMBER if self.action_mode == "raw" else 1.0
        for index, number in enumerate(numbers):
            if not math.isfinite(number):
                raise ArgumentError(f"action: expected finite numbers, got {number} at index {index}")
            if abs(number) > limit and not self.clip_actions:
                raise ArgumentError(
                    f"action: expected numbers from -{limit:g} to {limit:g}, got {number} at index {index}; "
                    "clip it, or use clip_actions=True"
                )
        return [-limit if number < -limit else min(number, limit) for number in numbers]

    def _scale(self, quantity: int, part: float, joint: int, fraction: float, previous: list[float]) -> float:
        """A fraction as rad, rad/s or rad/s². A position applies after this part of the control step.

        The order of the operations is that of the simulator: another one would round differently.
        """
        velocity = VELOCITY_LIMIT_RAD_S[joint]
        if quantity == 1:
            return fraction * LIMIT_FRACTION * velocity
        if quantity == 2:
            return fraction * ACCELERATION_PER_VELOCITY * velocity
        largest = LIMIT_FRACTION * POSITION_LIMIT_RAD[joint]
        if self.action_mode == "delta":
            reach = LIMIT_FRACTION * velocity * CONTROL_STEP_S * part
            position = previous[joint] + fraction * reach
            return -largest if position < -largest else min(position, largest)
        centre = START_Q[joint]
        reach = largest + centre if fraction < 0.0 else largest - centre
        return centre + fraction * reach


def _flatten(values: Any, name: str) -> list[float]:
    """All numbers of nested sequences, in order. `name` is the argument's, for the error message."""
    return list(_numbers(values, name))


def _numbers(values: Any, name: str) -> Iterator[float]:
    if hasattr(values, "tolist"):
        values = values.tolist()  # NumPy, torch
    if isinstance(values, (list, tuple)):
        for value in values:
            yield from _numbers(value, name)
    elif isinstance(values, (int, float)) and not isinstance(values, bool):
        yield float(values)
    else:
        raise ArgumentTypeError(f"{name}: expected numbers in a list or an array, got {values!r:.80}")
