"""The dataset of an evaluation: the recording of all its episodes, with the results."""

from __future__ import annotations

import json
from functools import cached_property
from typing import Any, Iterator, Literal, Sequence

import numpy as np
import pyarrow as pa

from faceoff.errors import ArgumentError, ArgumentTypeError

from ._container import Container
from ._episode import CONSTRAINTS, Episode
from ._errors import DatasetError
from ._rows import Rows, to_polars

__all__ = ["LAYOUTS", "Dataset", "Table"]

LAYOUTS = ("faceoff-dataset/4", "faceoff-dataset/3", "faceoff-dataset/2")
"""The supported layouts, newest first."""

Table = Literal["steps", "episodes"]

# Host interference: the time that other programs on the evaluator's machine took while the agent computed.
HOST_INTERFERENCE = "host_time_ns"
COMPUTATION_TIME = "computation_time_ns"


class Dataset:
    """The recording of an evaluation. Iterating gives its episodes in the order of the file.

    Only the manifest is read on opening. An object must not be used by several threads at once.
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
        container.check_manifest(manifest, LAYOUTS, agent=str, seed=str, mismatch_seed=str, episodes=dict, files=dict)

    @property
    def layout(self) -> str:
        """One of `LAYOUTS`."""
        return str(self.manifest["schema"])

    @property
    def agent(self) -> str:
        """The agent's name."""
        return str(self.manifest["agent"])

    @property
    def seed(self) -> str:
        """The evaluation's seed, 64 hexadecimal digits."""
        return str(self.manifest["seed"])

    @property
    def mismatch_seed(self) -> str:
        """The seed of the robot's deviation from its model, 64 hexadecimal digits; the same in all datasets of a season.

        It is the `mismatch_seed` of the environments, which then have that robot.
        """
        return str(self.manifest["mismatch_seed"])

    @property
    def profile(self) -> str:
        """The profile of perturbations."""
        return str(self.manifest["profile"])

    @property
    def ruleset(self) -> str:
        """The ruleset of the evaluation, e.g. `airhockey-2023.3`."""
        return str(self.manifest["ruleset"])

    @property
    def tasks(self) -> tuple[str, ...]:
        """The evaluated tasks, in the order of the file."""
        return tuple(self.manifest["episodes"])

    @cached_property
    def results(self) -> dict[str, Any]:
        """The scores: `results.json`."""
        return self._container.json("results.json")

    @cached_property
    def violations(self) -> dict[str, Any]:
        """Violations of constraints: `violations.json`."""
        return self._container.json("violations.json")

    @cached_property
    def calibration(self) -> dict[str, Any]:
        """Timing measurements of the slots: `calibration.json`."""
        return self._container.json("calibration.json")

    @cached_property
    def log(self) -> str:
        """The beginning and the end of the agent's standard error, with its faults."""
        return self._container.bytes("agent.log").decode(errors="replace")

    def check(self) -> None:
        """Reads every file and compares it with its size and hash.

        The BLAKE3 hashes of the manifest are compared if the package `blake3` is installed; otherwise
        only sizes and an archive's own checksums. `faceoff verify` also repeats the simulation.

        Raises:
            DatasetError: a file is missing, damaged or altered.
        """
        self._container.check(self.manifest["files"])

    def __len__(self) -> int:
        return len(self._episodes)

    def __iter__(self) -> Iterator[Episode]:
        return iter(self._episodes)

    def episodes(self, task: str | None = None) -> list[Episode]:
        """The episodes, of one task or of all.

        Raises:
            ArgumentError: the dataset does not have the task.
            DatasetError: the table is damaged.
        """
        if task is None:
            return list(self._episodes)
        self._check_task(task)
        return [episode for episode in self._episodes if episode.task == task]

    def episode(self, task: str, index: int) -> Episode:
        """One episode.

        Raises:
            ArgumentError: there is no episode with this task and index.
            ArgumentTypeError: the index is not a whole number.
            DatasetError: the table is damaged.
        """
        episodes = self.episodes(task)
        if not isinstance(index, (int, np.integer)):
            raise ArgumentTypeError(f"index: expected a whole number, got {index!r}")
        if not 0 <= index < len(episodes):
            raise ArgumentError(
                f"index: expected an episode of {task} from 0 to {len(episodes) - 1}, got {index}"
            )
        return episodes[index]

    def table(
        self,
        table: Table = "steps",
        *,
        task: str | None = None,
        columns: Sequence[str] | None = None,
    ) -> pa.Table:
        """A table as a pyarrow table. `steps` takes about 550 bytes of memory per control step.

        Args:
            table: `steps`, a row per answered control step, or `episodes`, a row per episode.
            task: only the rows of this task.
            columns: names of columns, in this order; None for all.

        Raises:
            ArgumentError: the table or task does not exist.
            DatasetError: a column does not exist, or the file is damaged.
        """
        if table not in ("steps", "episodes"):
            raise ArgumentError(f"table: expected 'steps' or 'episodes', got {table!r}")
        if task is not None:
            self._check_task(task)
        if table == "steps":
            first, last = self._step_range(task)
            return self._read_steps(first, last - first, columns)
        indices = [i for i, e in enumerate(self._episodes) if task in (None, e.task)]
        start = indices[0] if indices else 0
        return self._episode_rows.read(start, len(indices), columns)

    def to_pandas(
        self,
        table: Table = "steps",
        *,
        task: str | None = None,
        columns: Sequence[str] | None = None,
    ) -> Any:
        """Like `table`, as a pandas data frame."""
        return self.table(table, task=task, columns=columns).to_pandas()

    def to_polars(
        self,
        table: Table = "steps",
        *,
        task: str | None = None,
        columns: Sequence[str] | None = None,
    ) -> Any:
        """Like `table`, as a polars data frame."""
        return to_polars(self.table(table, task=task, columns=columns))

    def rows(self, episode: Episode, columns: Sequence[str] | None) -> pa.Table:
        """The control steps of an episode of this dataset, a row each. `Episode.table` calls it."""
        row_index = self._row_indices[episode.task, episode.index]
        return self._read_steps(int(self._offsets[row_index]), episode.steps, columns)

    def episode_row(self, episode: Episode) -> dict[str, Any]:
        """The row of `episodes.parquet` of an episode of this dataset."""
        row_index = self._row_indices[episode.task, episode.index]
        row: dict[str, Any] = self._episode_table.slice(row_index, 1).to_pylist()[0]
        return row

    def __repr__(self) -> str:
        return f"<Dataset of {self.agent}: {self.manifest['episodes']}, {self.path}>"

    def _check_task(self, task: str) -> None:
        if task not in self.tasks:
            raise ArgumentError(f"task: expected one of {', '.join(self.tasks)}, got {task!r}")

    def _read_steps(self, start: int, count: int, columns: Sequence[str] | None) -> pa.Table:
        rows = self._step_rows
        if HOST_INTERFERENCE in rows.columns or isinstance(columns, str):
            return rows.read(start, count, columns)
        # Layouts before 4 do not record host interference; it counts as 0.
        stored = None if columns is None else [name for name in columns if name != HOST_INTERFERENCE]
        if columns is not None and len(stored or []) == len(columns):
            return rows.read(start, count, columns)
        table = rows.read(start, count, stored)
        names = table.column_names
        position = names.index(COMPUTATION_TIME) + 1 if columns is None else list(columns).index(HOST_INTERFERENCE)
        return table.add_column(position, HOST_INTERFERENCE, pa.array(np.zeros(count, dtype=np.int64)))

    def _step_range(self, task: str | None) -> tuple[int, int]:
        if task is None:
            return 0, int(self._offsets[-1])
        indices = [i for i, episode in enumerate(self._episodes) if episode.task == task]
        if not indices:
            return 0, 0
        return int(self._offsets[indices[0]]), int(self._offsets[indices[-1] + 1])

    @cached_property
    def _step_rows(self) -> Rows:
        name = "steps.parquet"
        rows = Rows(self._container.table(name), f"{self.path}: {name}")
        if len(rows) != int(self._offsets[-1]):
            raise DatasetError(
                f"{self.path}: {name}: expected {int(self._offsets[-1])} rows as episodes.parquet "
                f"has it, got {len(rows)}"
            )
        return rows

    @cached_property
    def _episode_rows(self) -> Rows:
        name = "episodes.parquet"
        return Rows(self._container.table(name), f"{self.path}: {name}")

    @cached_property
    def _episode_table(self) -> pa.Table:
        return self._episode_rows.read()

    @cached_property
    def _episodes(self) -> list[Episode]:
        required = (
            *("task", "episode", "seed", "interpolation", "steps", "end", "success", "fault"),
            *("penalty_points", "computation_time_mean_s", "computation_time_max_s"),
            *(f"violated_{group}" for group in CONSTRAINTS),
        )
        for name in required:
            if name not in self._episode_table.column_names:
                raise DatasetError(f"{self.path}: episodes.parquet has no column {name!r}")
        return [self._episode(row) for row in self._episode_table.select(required).to_pylist()]

    def _episode(self, row: dict[str, Any]) -> Episode:
        try:
            fault = None if row["fault"] is None else json.loads(row["fault"])
        except ValueError as error:
            raise DatasetError(f"{self.path}: episodes.parquet: fault: {error}") from error
        return Episode(
            task=row["task"],
            index=row["episode"],
            seed=row["seed"],
            interpolation=row["interpolation"],
            steps=row["steps"],
            end=row["end"],
            success=row["success"],
            violated=frozenset(group for group in CONSTRAINTS if row[f"violated_{group}"]),
            penalty_points=row["penalty_points"],
            computation_time_mean_s=row["computation_time_mean_s"],
            computation_time_max_s=row["computation_time_max_s"],
            fault=fault,
            _source=self,
        )

    @cached_property
    def _row_indices(self) -> dict[tuple[str, int], int]:
        return {(e.task, e.index): row for row, e in enumerate(self._episodes)}

    @cached_property
    def _offsets(self) -> Any:
        """First row of each episode in `steps.parquet`, and the number of all rows."""
        return np.concatenate([[0], np.cumsum([e.steps for e in self._episodes], dtype=np.int64)])
