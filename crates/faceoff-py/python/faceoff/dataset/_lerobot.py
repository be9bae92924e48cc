"""Export as a LeRobot dataset of version 3.0, without a dependency on LeRobot."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Iterable, Mapping

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.parquet as pq

from ._dataset import Dataset
from ._episode import JOINT_POS, JOINT_VEL, OPPONENT_EE, PUCK, Episode
from ._errors import ExistsError
from ._rewards import Reward, checked_rewards, success_at_end
from ._select import Selection, select

__all__ = ["to_lerobot"]

# Constants of LeRobot's format.
VERSION = "v3.0"
FPS = 50
FILES_PER_CHUNK = 1000
DATA_FILE_MB = 100
VIDEO_FILE_MB = 200
DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
EPISODES_PATH = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
INSTRUCTIONS = {
    "hit": "Hit the puck into the opponent's goal.",
    "defend": "Bring the incoming puck under control on your own half.",
    "prepare": "Bring the puck to a place on your own half from which a shot is possible.",
}

Array = npt.NDArray[Any]
Frames = dict[str, Array]


def to_lerobot(
    dataset: Dataset,
    root: str | os.PathLike[str],
    task: str,
    *,
    episodes: Iterable[Episode] | None = None,
    reward: Reward = success_at_end,
    data_file_mb: int = DATA_FILE_MB,
) -> Path:
    """Writes the episodes of one task as a LeRobot dataset, which
    ``LeRobotDataset("me/name", root=root)`` opens.

    A frame is a control step, in float32: `observation.state`, observed joint positions and velocities,
    shape (14,); `observation.environment_state`, the puck's pose and rates, shape (6,),
    with an opponent also its end effector, shape (9,); `action`, flat; `next.reward`, `next.done`,
    `next.success`. Lengths in m, angles in rad, velocities per s. Episodes are renumbered; the
    additional columns `seed`, `end` and `source_episode` identify the original ones. Episodes without an
    answered step are left out.

    Args:
        dataset: the dataset to convert.
        root: a folder that does not exist yet.
        task: `hit`, `defend` or `prepare`.
        episodes: the episodes to convert; None for all of the task.
        reward: computes the rewards of an episode; the evaluation has none.
        data_file_mb: maximum size of a file of frames, MiB in memory.

    Returns:
        The folder.

    Raises:
        ArgumentError: the dataset does not have the task.
        ExistsError: the folder exists already.
        DatasetError: the dataset is damaged, or actions have different shapes.
    """
    folder = Path(root)
    if folder.exists():
        raise ExistsError(f"root: {folder} is there already; name another folder")
    selection = select(dataset, task, episodes)
    features = _features(selection)
    rows: list[dict[str, Any]] = []
    all_frames: list[Frames] = []
    first = 0
    with _DataFiles(folder, _schema(features), data_file_mb << 20) as files:
        for number, episode in enumerate(selection.episodes):
            frames = _frames(episode, number, first, reward)
            chunk, file = files.write(frames)
            rows.append(
                {
                    "episode_index": number,
                    "tasks": [INSTRUCTIONS[task]],
                    "length": episode.steps,
                    "data/chunk_index": chunk,
                    "data/file_index": file,
                    "dataset_from_index": first,
                    "dataset_to_index": first + episode.steps,
                    "meta/episodes/chunk_index": 0,
                    "meta/episodes/file_index": 0,
                    "seed": episode.seed,
                    "end": episode.end,
                    "success": episode.success,
                    "source_episode": episode.index,
                    **{
                        f"stats/{key}/{name}": value
                        for key, values in frames.items()
                        for name, value in _stats(values).items()
                    },
                }
            )
            all_frames.append(frames)
            first += episode.steps
    meta = folder / EPISODES_PATH.format(chunk_index=0, file_index=0)
    meta.parent.mkdir(parents=True)
    pq.write_table(pa.Table.from_pylist(rows), meta)
    pq.write_table(_tasks([INSTRUCTIONS[task]]), folder / "meta/tasks.parquet")
    stats = {key: _stats(np.concatenate([f[key] for f in all_frames])) for key in features}
    _write_json(folder / "meta/stats.json", stats)
    _write_json(folder / "meta/info.json", _info(dataset, selection, features, first, data_file_mb))
    return folder


def _features(selection: Selection) -> dict[str, dict[str, Any]]:
    """Type, shape and names of the components of each column."""

    def numbers(names: Iterable[str]) -> dict[str, Any]:
        parts = list(names)
        return {"dtype": "float32", "shape": [len(parts)], "names": parts}

    def single(dtype: str) -> dict[str, Any]:
        return {"dtype": dtype, "shape": [1], "names": None}

    opponent = OPPONENT_EE if selection.task == "hit" else ()
    width = int(np.prod(selection.action_shape))
    return {
        "observation.state": numbers((*JOINT_POS, *JOINT_VEL)),
        "observation.environment_state": numbers((*PUCK, *opponent)),
        "action": numbers(f"action_{i}" for i in range(width)),
        "next.reward": single("float32"),
        "next.done": single("bool"),
        "next.success": single("bool"),
        "timestamp": single("float32"),
        "frame_index": single("int64"),
        "episode_index": single("int64"),
        "index": single("int64"),
        "task_index": single("int64"),
    }


def _schema(features: Mapping[str, dict[str, Any]]) -> pa.Schema:
    def column(feature: dict[str, Any]) -> pa.DataType:
        kind = {"float32": pa.float32(), "int64": pa.int64(), "bool": pa.bool_()}[feature["dtype"]]
        (width,) = feature["shape"]
        return kind if width == 1 else pa.list_(kind, width)

    return pa.schema([(key, column(feature)) for key, feature in features.items()])


def _frames(episode: Episode, number: int, first: int, reward: Reward) -> Frames:
    """The columns of an episode with this number in the export, whose first frame has the index `first` there."""
    arrays = episode.to_numpy()
    steps = episode.steps
    observations = arrays.observations[:-1].astype(np.float32)
    frame = np.arange(steps)
    last = frame + 1 == steps
    return {
        "observation.state": observations[:, 6:20],
        "observation.environment_state": np.concatenate(
            [observations[:, :6], observations[:, 20:]], axis=1
        ),
        "action": arrays.actions.reshape(steps, -1).astype(np.float32),
        "next.reward": checked_rewards(reward, episode, arrays).astype(np.float32),
        "next.done": last,
        "next.success": last & episode.success,
        "timestamp": (frame / FPS).astype(np.float32),
        "frame_index": frame.astype(np.int64),
        "episode_index": np.full(steps, number, dtype=np.int64),
        "index": first + frame.astype(np.int64),
        "task_index": np.zeros(steps, dtype=np.int64),
    }


class _DataFiles:
    """Writer of frame files: a row group per episode, each episode in a single file."""

    def __init__(self, folder: Path, schema: pa.Schema, limit_bytes: int) -> None:
        self._folder = folder
        self._schema = schema
        self._limit_bytes = limit_bytes
        self._number = -1
        self._bytes = 0
        self._writer: pq.ParquetWriter | None = None

    def write(self, frames: Frames) -> tuple[int, int]:
        """Adds an episode; returns the numbers of its chunk and file."""
        columns = []
        for field in self._schema:
            values = frames[field.name]
            if pa.types.is_fixed_size_list(field.type):
                flat = pa.array(np.ascontiguousarray(values).reshape(-1), field.type.value_type)
                columns.append(pa.FixedSizeListArray.from_arrays(flat, field.type.list_size))
            else:
                columns.append(pa.array(values, field.type))
        table = pa.Table.from_arrays(columns, schema=self._schema)
        if self._writer is None or self._bytes + table.nbytes > self._limit_bytes:
            self._open_next()
        assert self._writer is not None
        self._writer.write_table(table)
        self._bytes += table.nbytes
        return divmod(self._number, FILES_PER_CHUNK)

    def _open_next(self) -> None:
        self._close()
        self._number += 1
        self._bytes = 0
        chunk, file = divmod(self._number, FILES_PER_CHUNK)
        path = self._folder / DATA_PATH.format(chunk_index=chunk, file_index=file)
        path.parent.mkdir(parents=True, exist_ok=True)
        self._writer = pq.ParquetWriter(path, self._schema)

    def _close(self) -> None:
        if self._writer is not None:
            self._writer.close()
            self._writer = None

    def __enter__(self) -> _DataFiles:
        return self

    def __exit__(self, *_: object) -> None:
        self._close()


def _stats(values: Array) -> dict[str, list[float]]:
    """Statistics of a column (frames,) or (frames, width), as lists of one or `width` numbers."""
    numbers = values.astype(np.float64).reshape(len(values), -1)
    out = {
        "min": numbers.min(axis=0),
        "max": numbers.max(axis=0),
        "mean": numbers.mean(axis=0),
        "std": numbers.std(axis=0),
    }
    quantiles = np.quantile(numbers, list(QUANTILES.values()), axis=0)
    out |= dict(zip(QUANTILES, quantiles))
    return {"count": [len(values)], **{name: value.tolist() for name, value in out.items()}}


def _tasks(instructions: list[str]) -> pa.Table:
    """A row per task; its text is the index of the data frame that LeRobot reads."""
    index = "__index_level_0__"
    table = pa.table({"task_index": pa.array(range(len(instructions)), pa.int64()), index: instructions})

    def column(name: str | None, field: str, kind: str, numpy: str) -> dict[str, Any]:
        return {
            "name": name,
            "field_name": field,
            "pandas_type": kind,
            "numpy_type": numpy,
            "metadata": None,
        }

    pandas = {
        "index_columns": [index],
        "column_indexes": [],
        "columns": [
            column("task_index", "task_index", "int64", "int64"),
            column(None, index, "unicode", "object"),
        ],
        "pandas_version": "2.0.0",
    }
    return table.replace_schema_metadata({"pandas": json.dumps(pandas)})


def _info(
    dataset: Dataset,
    selection: Selection,
    features: Mapping[str, dict[str, Any]],
    frame_count: int,
    data_file_mb: int,
) -> dict[str, Any]:
    return {
        "codebase_version": VERSION,
        "robot_type": "iiwa14_air_hockey",
        "total_episodes": len(selection.episodes),
        "total_frames": frame_count,
        "total_tasks": 1,
        "chunks_size": FILES_PER_CHUNK,
        "data_files_size_in_mb": data_file_mb,
        "video_files_size_in_mb": VIDEO_FILE_MB,
        "fps": FPS,
        "splits": {"train": f"0:{len(selection.episodes)}"},
        "data_path": DATA_PATH,
        "video_path": None,
        "features": features,
        "faceoff": {
            "agent": dataset.agent,
            "task": selection.task,
            "profile": dataset.profile,
            "ruleset": dataset.ruleset,
            "action_shape": list(selection.action_shape),
        },
    }


def _write_json(path: Path, value: Mapping[str, Any]) -> None:
    path.write_text(json.dumps(value, indent=4) + "\n")


