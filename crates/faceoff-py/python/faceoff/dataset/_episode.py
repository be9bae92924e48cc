"""One recorded episode."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Mapping, Protocol, Sequence

import numpy as np
import pyarrow as pa

from ._errors import DatasetError
from ._rows import Floats, floats, lists, seconds, to_polars

__all__ = ["ACTION_SHAPES", "CONSTRAINTS", "Episode", "EpisodeArrays", "action_shape"]

ACTION_SHAPES: Mapping[str, tuple[int, ...]] = {
    "1": (7,),
    "2": (7,),
    "3": (2, 7),
    "4": (2, 7),
    "5": (3, 7),
    "-1": (2, 7),
    "null": (20, 3, 7),
}
"""Shape of an action for each interpolation that an agent can choose."""

CONSTRAINTS = ("joint_pos", "joint_vel", "ee", "link")
"""The constraint groups, in the order of `EpisodeArrays.constraints`."""

PUCK = ("puck_x", "puck_y", "puck_yaw", "puck_vx", "puck_vy", "puck_yaw_rate")
EE = ("ee_x", "ee_y", "ee_z")
UNIVERSAL = ("universal_1", "universal_2")
JOINT_POS = tuple(f"q_{joint}" for joint in range(1, 8))
JOINT_VEL = tuple(f"dq_{joint}" for joint in range(1, 8))
OPPONENT_EE = tuple(f"opponent_{name}" for name in EE)
OBSERVATION = tuple(f"obs_{name}" for name in (*PUCK, *JOINT_POS, *JOINT_VEL, *OPPONENT_EE))
# Numbers in an observation without an opponent.
LEN_WITHOUT_OPPONENT = 20


class Source(Protocol):
    """Access to the rows of an episode."""

    def rows(self, episode: Episode, columns: Sequence[str] | None) -> pa.Table:
        """The control steps of an episode."""
        ...

    def episode_row(self, episode: Episode) -> dict[str, Any]:
        """An episode's row of `episodes.parquet`."""
        ...


@dataclass(frozen=True)
class EpisodeArrays:
    """An episode of N control steps as float64 arrays.

    Lengths in m, angles in rad, times in s. Observations are in the robot's base frame, the puck's true
    state in the table's frame, each end effector in the base frame of its own robot.
    """

    observations: Floats
    """Observations sent to the agent, shape (N + 1, 20), with an opponent (N + 1, 23); the last one follows
    the last action."""
    actions: Floats
    """The agent's actions, shape (N, *action_shape)."""
    puck: Floats
    """True x, y, yaw and their rates, shape (N + 1, 6); row 0 is the state before the first step."""
    joint_pos: Floats
    """True joint positions, shape (N + 1, 7)."""
    joint_vel: Floats
    """True joint velocities, shape (N + 1, 7)."""
    universal: Floats
    """Angles of the mallet's universal joint, shape (N + 1, 2)."""
    ee: Floats
    """Position of the end effector, shape (N + 1, 3)."""
    opponent_ee: Floats | None
    """The opponent's end effector, shape (N + 1, 3); None without an opponent."""
    constraints: Floats
    """Largest value of each group of `CONSTRAINTS` after the step, violated above 0, shape (N, 4)."""
    computation_time_s: Floats
    """Time until the answer minus host interference, shape (N,)."""
    host_time_s: Floats
    """Host interference during the answer (time that other programs on the machine took), shape (N,)."""
    cpu_time_s: Floats
    """CPU time of the agent's processes, shape (N,); NaN where the host did not measure it."""


@dataclass(frozen=True)
class Episode:
    """A recorded episode: its outcome, and access to its control steps."""

    task: str
    """`hit`, `defend` or `prepare`."""
    index: int
    """Its number within the task, from 0."""
    seed: str
    """The episode's seed, 64 hexadecimal digits."""
    interpolation: str | None
    """A key of `ACTION_SHAPES`; None if the agent failed before it named one."""
    steps: int
    """Answered control steps, N."""
    end: str
    """`horizon`, `left_table`, `crossed_middle`, `stopped`, `reached_axis` or `agent_fault`."""
    success: bool
    violated: frozenset[str]
    """The groups of `CONSTRAINTS` that were violated at least once."""
    penalty_points: float
    """Penalty points of the episode, computation time included."""
    computation_time_mean_s: float
    computation_time_max_s: float
    fault: dict[str, Any] | None
    """The agent fault that ended the episode, or None."""
    _source: Source = field(repr=False, compare=False, hash=False)

    @property
    def terminated(self) -> bool:
        """Whether the task ended the episode, not the horizon or an agent fault."""
        return self.end not in ("horizon", "agent_fault")

    @property
    def truncated(self) -> bool:
        """Whether the horizon or an agent fault ended the episode."""
        return not self.terminated

    @property
    def action_shape(self) -> tuple[int, ...]:
        """Shape of one action; (0,) without an interpolation.

        Raises:
            DatasetError: the interpolation is unknown.
        """
        return action_shape(self.interpolation, str(self))

    def table(self, columns: Sequence[str] | None = None) -> pa.Table:
        """The control steps, with the columns of `steps.parquet`.

        Args:
            columns: names of columns, in this order; None for all.

        Raises:
            DatasetError: a column does not exist, or the file is damaged.
        """
        return self._source.rows(self, columns)

    def to_pandas(self, columns: Sequence[str] | None = None) -> Any:
        """Like `table`, as a pandas data frame."""
        return self.table(columns).to_pandas()

    def to_polars(self, columns: Sequence[str] | None = None) -> Any:
        """Like `table`, as a polars data frame."""
        return to_polars(self.table(columns))

    def to_numpy(self) -> EpisodeArrays:
        """The control steps as arrays.

        Raises:
            DatasetError: the file is damaged.
        """
        steps, row = self.table(), self._source.episode_row(self)

        def with_initial(names: tuple[str, ...]) -> Floats:
            initial = np.array([[row[f"initial_{name}"] for name in names]], dtype=np.float64)
            return np.concatenate([initial, floats(steps, names)])

        has_opponent = row[f"initial_{OPPONENT_EE[0]}"] is not None
        names = OBSERVATION if has_opponent else OBSERVATION[:LEN_WITHOUT_OPPONENT]
        observations = floats(steps, names)
        # An episode without an answer has no last observation.
        last = [row[f"last_{name}"] for name in names] if self.steps else []
        if None in last:
            raise DatasetError(f"{self}: episodes.parquet has no last observation of it")
        return EpisodeArrays(
            observations=np.concatenate([observations, np.reshape(last, (-1, len(names)))]),
            actions=lists(steps, "action", self.action_shape, str(self)),
            puck=with_initial(PUCK),
            joint_pos=with_initial(JOINT_POS),
            joint_vel=with_initial(JOINT_VEL),
            universal=with_initial(UNIVERSAL),
            ee=with_initial(EE),
            opponent_ee=with_initial(OPPONENT_EE) if has_opponent else None,
            constraints=floats(steps, [f"constraint_{name}" for name in CONSTRAINTS]),
            computation_time_s=seconds(steps, "computation_time_ns"),
            host_time_s=seconds(steps, "host_time_ns"),
            cpu_time_s=seconds(steps, "cpu_time_ns"),
        )

    def __str__(self) -> str:
        return f"{self.task}, episode {self.index}"


def action_shape(interpolation: str | None, context: str) -> tuple[int, ...]:
    """Shape of an action of this interpolation; `context` begins the error message.

    Raises:
        DatasetError: the interpolation is unknown.
    """
    if interpolation is None:
        return (0,)
    try:
        return ACTION_SHAPES[interpolation]
    except KeyError:
        expected = ", ".join(ACTION_SHAPES)
        raise DatasetError(
            f"{context}: interpolation: expected one of {expected}, got {interpolation!r}"
        ) from None


