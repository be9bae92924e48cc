"""`faceoff.dataset` reads the same numbers as the program in all layouts (versions of the dataset's files)."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pyarrow")

import faceoff.dataset as fd  # noqa: E402
from dataset_recordings import FIXTURES, hold, list_episodes, odd, slice_of  # noqa: E402

LAYOUT_2 = FIXTURES / "dataset-layout-2.zip"
LAYOUT_3 = FIXTURES / "dataset-layout-3.zip"


def recordings() -> list[Path]:
    """Two datasets of the current layout and one of each earlier layout."""
    return [hold(), odd(), LAYOUT_2, LAYOUT_3]


# Their number.
RECORDINGS = 4


@pytest.mark.parametrize("index", range(RECORDINGS))
def test_tables_equal_those_of_the_program(index: int) -> None:
    path = recordings()[index]
    dataset = fd.open_dataset(path)
    for episode in dataset:
        rows = slice_of(path, episode.task, episode.index)
        table = episode.table().to_pylist()
        # Earlier layouts have no such column in the program's output, and 0 in the package.
        rows = [row if "host_time_ns" in row else {**row, "host_time_ns": 0} for row in rows]
        assert table == rows


@pytest.mark.parametrize("index", range(RECORDINGS))
def test_episodes_equal_those_of_the_program(index: int) -> None:
    path = recordings()[index]
    dataset = fd.open_dataset(path)
    assert len(dataset) == len(list_episodes(path))
    for episode, expected in zip(dataset, list_episodes(path), strict=True):
        assert (episode.task, episode.index) == (expected["task"], expected["episode"])
        assert (episode.seed, episode.interpolation) == (expected["seed"], expected["interpolation"])
        assert (episode.steps, episode.end) == (expected["steps"], expected["end"])
        assert (episode.success, episode.penalty_points) == (expected["success"], expected["penalty_points"])
        assert episode.violated == {group for group, violated in expected["violations"].items() if violated}
        assert episode.computation_time_max_s == expected["computation_time"]["max_s"]
        assert episode.fault == expected["fault"]
        assert episode.terminated != episode.truncated
    results = dataset.results["tasks"]
    for task in dataset.tasks:
        assert len(dataset.episodes(task)) == results[task]["episodes"]
        assert sum(e.success for e in dataset.episodes(task)) == results[task]["successes"]


def test_episode_has_one_more_observation_than_actions() -> None:
    dataset = fd.open_dataset(hold())
    for task, width in (("hit", 23), ("defend", 20), ("prepare", 20)):
        episode = dataset.episode(task, 1)
        arrays = episode.to_numpy()
        steps = episode.steps
        assert arrays.observations.shape == (steps + 1, width)
        assert arrays.actions.shape == (steps, 2, 7)
        assert np.isfinite(arrays.observations).all() and np.isfinite(arrays.actions).all()
        assert arrays.puck.shape == (steps + 1, 6)
        assert arrays.joint_pos.shape == arrays.joint_vel.shape == (steps + 1, 7)
        assert arrays.ee.shape == (steps + 1, 3) and arrays.universal.shape == (steps + 1, 2)
        assert arrays.constraints.shape == (steps, 4)
        assert (arrays.opponent_ee is not None) == (task == "hit")
        assert (arrays.computation_time_s > 0).all()
        # The true state is close to the observed one, in the documented frames.
        assert np.abs(arrays.joint_pos - arrays.observations[:, 6:13]).max() < 0.01
        assert np.allclose(arrays.ee[:, 2], 0.1645, atol=0.02)


def test_arrays_equal_the_rows() -> None:
    path = hold()
    episode = fd.open_dataset(path).episode("hit", 2)
    rows, arrays = slice_of(path, "hit", 2), episode.to_numpy()
    for step, row in enumerate(rows):
        assert arrays.observations[step, 0] == row["obs_puck_x"]
        assert arrays.observations[step, 22] == row["obs_opponent_ee_z"]
        assert arrays.actions[step].reshape(-1).tolist() == row["action"]
        assert arrays.puck[step + 1, 5] == row["puck_yaw_rate"]
        assert arrays.joint_vel[step + 1, 6] == row["dq_7"]
        assert arrays.constraints[step, 1] == row["constraint_joint_vel"]
        assert arrays.computation_time_s[step] == row["computation_time_ns"] / 1e9


def test_aborted_episodes_have_their_answered_steps() -> None:
    dataset = fd.open_dataset(odd())
    aborted, missing, complete = dataset.episodes("hit")
    assert (aborted.end, aborted.steps, aborted.action_shape) == ("agent_fault", 7, (3, 7))
    assert aborted.fault is not None and aborted.truncated
    assert aborted.to_numpy().observations.shape == (8, 23)
    assert (missing.end, missing.steps) == ("agent_fault", 0)
    empty = missing.to_numpy()
    assert empty.observations.shape == (0, 23) and len(empty.actions) == 0
    assert empty.puck.shape == (1, 6)
    assert complete.to_numpy().actions.shape == (complete.steps, 3, 7)
    assert complete.violated >= {"ee"}
    assert dataset.episode("defend", 2).to_numpy().actions.shape[1:] == (20, 3, 7)


def test_tables_are_filtered_by_task_and_column() -> None:
    dataset = fd.open_dataset(hold())
    defend = dataset.table(task="defend", columns=["step", "action", "puck_x"])
    assert defend.column_names == ["step", "action", "puck_x"]
    steps = [episode.steps for episode in dataset.episodes("defend")]
    assert defend.num_rows == sum(steps)
    assert defend["step"].to_pylist() == [step for count in steps for step in range(count)]
    assert dataset.table("episodes", task="prepare")["task"].to_pylist() == ["prepare"] * 3
    assert dataset.table().num_rows == sum(episode.steps for episode in dataset)
    # The column is missing in layout 2; it is added at the requested position.
    old = fd.open_dataset(LAYOUT_2).table(columns=["host_time_ns", "step"])
    assert old.column_names == ["host_time_ns", "step"] and set(old[0].to_pylist()) == {0}


def test_pandas_and_polars_frames_equal_the_table() -> None:
    pytest.importorskip("pandas")
    pytest.importorskip("polars")
    dataset = fd.open_dataset(hold())
    episode = dataset.episode("defend", 0)
    rows = episode.table(["puck_x", "q_1"]).to_pylist()
    assert episode.to_pandas(["puck_x", "q_1"]).to_dict("records") == rows
    assert episode.to_polars(["puck_x", "q_1"]).to_dicts() == rows
    assert dataset.to_polars("episodes")["steps"].sum() == len(dataset.to_pandas())
    ends = dataset.to_pandas("episodes").groupby("task")["end"].count()
    assert ends.to_dict() == {"hit": 3, "defend": 3, "prepare": 3}


def test_folders_and_repacked_archives_are_read(tmp_path: Path) -> None:
    expected = fd.open_dataset(hold()).table()
    with zipfile.ZipFile(hold() / "dataset.zip") as packed:
        packed.extractall(tmp_path / "folder")
        with zipfile.ZipFile(tmp_path / "repacked.zip", "w", zipfile.ZIP_DEFLATED) as repacked:
            for name in packed.namelist():
                repacked.writestr(name, packed.read(name))
    for path in (tmp_path / "folder", tmp_path / "repacked.zip", hold() / "dataset.zip"):
        dataset = fd.open_dataset(path)
        dataset.check()
        assert dataset.table().equals(expected)
        assert dataset.violations["schema"] == dataset.layout == "faceoff-dataset/4"
        assert dataset.calibration["shards"] and isinstance(dataset.log, str)


def test_import_loads_neither_simulator_nor_pandas() -> None:
    program = (
        "import sys, faceoff.dataset\n"
        "loaded = {'faceoff._native', 'pandas', 'polars', 'minari', 'gymnasium'} & set(sys.modules)\n"
        "assert not loaded, loaded\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
