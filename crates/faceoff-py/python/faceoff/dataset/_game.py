"""The recording of a game, or of one side of it. A game consists of rallies; its two robots are sides 1 and 2."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Iterator, Sequence

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from faceoff.errors import ArgumentError

from ._container import Container
from ._errors import DatasetError
from ._episode import CONSTRAINTS, EE, JOINT_POS, JOINT_VEL, OBSERVATION, PUCK, action_shape
from ._rows import Floats, Rows, floats, lists, seconds, to_polars

__all__ = ["GAME_LAYOUTS", "Game", "Rally", "SideArrays"]

GAME_LAYOUTS = ("faceoff-game/1", "faceoff-game-side/1")
"""The supported layouts: a whole game, and the file of one side."""


@dataclass(frozen=True)
class SideArrays:
    """A rally of N control steps of one side, as float64 arrays.

    Lengths in m, angles in rad, times in s. Observations and the end effector are in the base frame of
    the side's robot, the puck's true state in the table's frame.
    """

    observations: Floats
    """Observations sent to the agent, shape (N, 23)."""
    actions: Floats
    """The agent's actions, shape (N, *action_shape); NaN without an answer."""
    effects: npt.NDArray[np.str_]
    """What became of the answer to each step: `in_time` (it was commanded), `late`, `fault`, or `held` (an earlier
    fault); shape (N,)."""
    puck: Floats
    """True x, y, yaw and their rates after the step, shape (N, 6)."""
    joint_pos: Floats
    """True joint positions after the step, shape (N, 7)."""
    joint_vel: Floats
    """True joint velocities after the step, shape (N, 7)."""
    ee: Floats
    """Position of the end effector after the step, shape (N, 3)."""
    constraints: Floats
    """Largest value of each constraint group (`CONSTRAINTS`), violated above 0, shape (N, 4)."""
    computation_time_s: Floats
    """Time until the answer minus host interference, shape (N,); NaN where the agent was not asked."""


@dataclass(frozen=True)
class Rally:
    """A rally of a game: its end, and access to its control steps."""

    index: int
    """Its number, from 0."""
    game_step: int
    """Control step of the game at which it began."""
    serves: int
    """The side on which the puck started, 1 or 2."""
    steps: int
    """Control steps, N."""
    end: str
    """`goal`, `foul`, `stuck`, `left_table`, `diverged` or `game_over`."""
    by: int | None
    """The side that scored or fouled, 1 or 2."""
    score: tuple[int, int]
    """The score of both sides after the rally."""
    _game: Game = field(repr=False, compare=False, hash=False)

    def table(self, name: str = "motion", columns: Sequence[str] | None = None) -> pa.Table:
        """The control steps, with the columns of `motion`, `side-1` or `side-2`.

        Raises:
            ArgumentError: the table does not exist or has no control steps.
            DatasetError: a column does not exist, or the file is damaged.
        """
        return self._game.rally_rows(self, name, columns)

    def to_pandas(self, name: str = "motion", columns: Sequence[str] | None = None) -> Any:
        """Like `table`, as a pandas data frame."""
        return self.table(name, columns).to_pandas()

    def to_polars(self, name: str = "motion", columns: Sequence[str] | None = None) -> Any:
        """Like `table`, as a polars data frame."""
        return to_polars(self.table(name, columns))

    def to_numpy(self, side: int) -> SideArrays:
        """The control steps of one side as arrays.

        Args:
            side: 1 or 2.

        Raises:
            ArgumentError: the recording does not have this side.
            DatasetError: a file is damaged.
        """
        self._game.check_side(side)
        steps, motion = self.table(f"side-{side}"), self.table("motion")
        entry = self._game.table(f"entries-{side}").slice(self.index, 1).to_pylist()[0]
        context = f"side {side}, rally {self.index}"

        def robot_columns(names: Sequence[str]) -> Floats:
            return floats(motion, [f"robot_{side}_{name}" for name in names])

        return SideArrays(
            observations=floats(steps, OBSERVATION),
            actions=lists(steps, "action", action_shape(entry["interpolation"], context), context),
            effects=np.asarray(steps.column("effect").to_pylist(), dtype=np.str_),
            puck=floats(motion, PUCK),
            joint_pos=robot_columns(JOINT_POS),
            joint_vel=robot_columns(JOINT_VEL),
            ee=robot_columns(EE),
            constraints=floats(steps, [f"constraint_{name}" for name in CONSTRAINTS]),
            computation_time_s=seconds(steps, "computation_time_ns"),
        )


class Game:
    """The recording of a game. Iterating gives its rallies.

    The file of one side has the motion, the rallies and that side's tables. An object must not be used by
    several threads at once.
    """

    def __init__(self, container: Container, manifest: dict[str, Any]) -> None:
        """Use `faceoff.dataset.open`.

        Raises:
            DatasetError: the manifest is invalid or of an unsupported layout.
        """
        self._container = container
        self.path = container.path
        self.manifest = manifest
        """The content of `manifest.json`."""
        container.check_manifest(manifest, GAME_LAYOUTS, agents=list, files=dict)

    @property
    def layout(self) -> str:
        """One of `GAME_LAYOUTS`."""
        return str(self.manifest["schema"])

    @property
    def agents(self) -> tuple[str, ...]:
        """The names of both sides' agents."""
        return tuple(str(agent) for agent in self.manifest["agents"])

    @property
    def mismatch_seed(self) -> str:
        """The seed of the robots' deviation from their model, 64 hexadecimal digits; see `Dataset.mismatch_seed`.

        Raises:
            DatasetError: it is not in a team's file of its own side.
        """
        seed = self.manifest.get("mismatch_seed")
        if not isinstance(seed, str):
            raise DatasetError(f"{self.path}: expected a game with its mismatch_seed, got a file of one side ({self.layout})")
        return seed

    @property
    def sides(self) -> tuple[int, ...]:
        """The sides whose observations and actions are recorded: 1, 2 or both."""
        return tuple(side for side in (1, 2) if f"side-{side}.parquet" in self.manifest["files"])

    @property
    def tables(self) -> tuple[str, ...]:
        """The names of its tables: `motion`, `rallies`, `side-1`, `entries-1` (how the agent of side 1 began each rally), …"""
        names = self.manifest["files"]
        return tuple(n.removesuffix(".parquet") for n in names if n.endswith(".parquet"))

    @cached_property
    def results(self) -> dict[str, Any]:
        """The scores: `results.json`."""
        return self._container.json("results.json")

    @cached_property
    def rallies(self) -> list[Rally]:
        """The rallies, in the order of play.

        Raises:
            DatasetError: the table is damaged.
        """
        return [
            Rally(
                index=row["rally"],
                game_step=row["game_step"],
                serves=row["serves"],
                steps=row["steps"],
                end=row["end"],
                by=row["by"],
                score=(row["score_1"], row["score_2"]),
                _game=self,
            )
            for row in self.table("rallies").to_pylist()
        ]

    def check(self) -> None:
        """Reads every file and compares it with its size and hash, as `Dataset.check` does.

        Raises:
            DatasetError: a file is missing, damaged or altered.
        """
        self._container.check(self.manifest["files"])

    def __len__(self) -> int:
        return len(self.rallies)

    def __iter__(self) -> Iterator[Rally]:
        return iter(self.rallies)

    def table(self, name: str, columns: Sequence[str] | None = None) -> pa.Table:
        """A table as a pyarrow table.

        Args:
            name: one of `tables`.
            columns: names of columns, in this order; None for all.

        Raises:
            ArgumentError: the table does not exist.
            DatasetError: a column does not exist, or the file is damaged.
        """
        return self._rows(name).read(columns=columns)

    def to_pandas(self, name: str, columns: Sequence[str] | None = None) -> Any:
        """Like `table`, as a pandas data frame."""
        return self.table(name, columns).to_pandas()

    def to_polars(self, name: str, columns: Sequence[str] | None = None) -> Any:
        """Like `table`, as a polars data frame."""
        return to_polars(self.table(name, columns))

    def rally_rows(self, rally: Rally, name: str, columns: Sequence[str] | None) -> pa.Table:
        """The control steps of a rally of this game, a row each. `Rally.table` calls it."""
        names = ["motion", *(f"side-{side}" for side in self.sides)]
        if name not in names:
            raise ArgumentError(f"name: expected one of {', '.join(names)}, got {name!r}")
        return self._rows(name).read(rally.game_step, rally.steps, columns)

    def check_side(self, side: int) -> None:
        """Checks that the recording has this side.

        Raises:
            ArgumentError: it has no tables of this side.
        """
        if side not in self.sides:
            known = " or ".join(map(str, self.sides))
            raise ArgumentError(f"side: expected {known}, got {side!r}")

    def __repr__(self) -> str:
        return f"<Game of {json.dumps(self.agents)}: {self.path}>"

    def _rows(self, name: str) -> Rows:
        if name not in self.tables:
            raise ArgumentError(f"name: expected one of {', '.join(self.tables)}, got {name!r}")
        if name not in self._open_tables:
            file = f"{name}.parquet"
            self._open_tables[name] = Rows(self._container.table(file), f"{self.path}: {file}")
        return self._open_tables[name]

    @cached_property
    def _open_tables(self) -> dict[str, Rows]:
        return {}
