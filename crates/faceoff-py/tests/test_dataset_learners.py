"""Exports of datasets for learning libraries: Minari datasets opened by Minari, and LeRobot datasets checked file by file.

LeRobot itself opens them in `tests_learning/test_lerobot.py`: it needs torch.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pyarrow")

import faceoff.dataset as fd  # noqa: E402
import pyarrow.parquet as pq  # noqa: E402
from dataset_recordings import FIXTURES, hold, odd  # noqa: E402

STRIKER = FIXTURES / "dataset-layout-2.zip"
HOLD = FIXTURES / "dataset-layout-3.zip"


def open_layout_2() -> fd.Dataset:
    dataset = fd.open_dataset(STRIKER)
    try:
        dataset.table(columns=["step"])
    except fd.DatasetError as error:
        pytest.skip(f"this pyarrow is too old: {error}")
    return dataset


@pytest.mark.parametrize("data_format", ["arrow", "hdf5"])
def test_minari_loads_every_episode(
    data_format: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    minari = pytest.importorskip("minari")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    dataset = open_layout_2()
    fd.to_minari(dataset, "faceoff/hit/striker-v0", data_format=data_format)
    read = minari.load_dataset("faceoff/hit/striker-v0")
    episodes = dataset.episodes("hit")
    assert read.total_episodes == len(episodes)
    assert read.total_steps == sum(episode.steps for episode in episodes)
    metadata = list(read.storage.get_episode_metadata(range(read.total_episodes)))
    for episode, exported, attributes in zip(episodes, read.iterate_episodes(), metadata, strict=True):
        arrays, steps = episode.to_numpy(), episode.steps
        assert exported.observations.shape == (steps + 1, 23)
        assert np.array_equal(exported.observations, arrays.observations.astype(np.float32))
        assert np.array_equal(exported.actions, arrays.actions.reshape(steps, 14).astype(np.float32))
        assert exported.rewards.tolist() == [0.0] * (steps - 1) + [float(episode.success)]
        assert exported.terminations[-1] == episode.terminated
        assert exported.truncations[-1] == episode.truncated
        assert not exported.terminations[:-1].any() and not exported.truncations[:-1].any()
        assert np.array_equal(exported.infos["puck"], arrays.puck)
        assert np.array_equal(exported.infos["constraints"][1:], arrays.constraints)
        assert (attributes["seed_hex"], attributes["end"]) == (episode.seed, episode.end)
        assert bool(attributes["success"]) == episode.success
        assert read.observation_space.contains(exported.observations[0])
        assert read.action_space.contains(exported.actions[0])
    assert read.storage.metadata["algorithm_name"] == "striker"


def test_minari_recovers_the_environment_of_the_dataset(tmp_path: Path) -> None:
    """In a process that has not imported the package, as after a download."""
    pytest.importorskip("minari")
    dataset = fd.open_dataset(hold())
    fd.to_minari(dataset, "faceoff/defend/hold-v0", root=tmp_path)
    program = """
import json, minari
dataset = minari.load_dataset("faceoff/defend/hold-v0")
env = dataset.recover_environment()
observation, _ = env.reset(seed=1)
episode = next(dataset.iterate_episodes())
env.step(episode.actions[0])
assert observation.shape == episode.observations[0].shape
print(json.dumps(env.spec.kwargs))
"""
    environment = {**os.environ, "MINARI_DATASETS_PATH": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, timeout=600, text=True)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == {
        "task": "defend",
        "action_mode": "raw",
        "interpolation": 3,
        "profile": dataset.profile,
        "mismatch_seed": dataset.mismatch_seed,
    }


def test_minari_export_accepts_reward_dtype_and_folder(tmp_path: Path) -> None:
    minari = pytest.importorskip("minari")
    dataset = open_layout_2()

    def speed(episode: fd.Episode, arrays: fd.EpisodeArrays) -> Any:
        return arrays.puck[1:, 3]

    successes = [episode for episode in dataset.episodes("hit") if episode.success]
    exported = fd.to_minari(
        dataset,
        "faceoff/hit/won-v1",
        episodes=successes,
        reward=speed,
        dtype="float64",
        root=tmp_path,
        author="a team",
    )
    assert exported.total_episodes == len(successes) == 1
    assert (tmp_path / "faceoff" / "hit" / "won-v1").is_dir()
    (read,) = exported.iterate_episodes()
    assert np.array_equal(read.rewards, successes[0].to_numpy().puck[1:, 3])
    assert np.array_equal(read.observations, successes[0].to_numpy().observations)
    assert exported.storage.metadata["author"] == {"a team"}
    with pytest.raises(ValueError, match="already"):
        fd.to_minari(dataset, "faceoff/hit/won-v1", root=tmp_path)
    assert minari.__version__


def test_minari_export_needs_an_unambiguous_task(tmp_path: Path) -> None:
    pytest.importorskip("minari")
    dataset = fd.open_dataset(HOLD)
    with pytest.raises(ValueError, match="task: expected one of hit, defend, got none"):
        fd.to_minari(dataset, "faceoff/hold-v0", root=tmp_path)
    with pytest.raises(ValueError, match="task: expected one of hit, defend, got 'prepare'"):
        fd.to_minari(dataset, "faceoff/hold-v0", task="prepare", root=tmp_path)
    with pytest.raises(ValueError, match="episodes: expected episodes of hit, got one of defend"):
        fd.to_minari(dataset, "faceoff/hit/hold-v0", episodes=dataset, root=tmp_path)
    with pytest.raises(fd.DatasetError, match=r"reward: expected shape \(\d+,\), got \(\)"):
        fd.to_minari(
            dataset, "faceoff/hit/hold-v0", reward=lambda e, a: np.float64(1), root=tmp_path
        )
    with pytest.raises(ValueError, match="dtype: expected 'float32' or 'float64', got 'int8'"):
        fd.to_minari(dataset, "faceoff/hit/hold-v0", dtype="int8", root=tmp_path)
    exported = fd.to_minari(dataset, "faceoff/hold-v0", task="defend", root=tmp_path)
    assert exported.observation_space.shape == (20,)


def test_episodes_without_a_step_are_left_out(tmp_path: Path) -> None:
    pytest.importorskip("minari")
    dataset = fd.open_dataset(odd())
    exported = fd.to_minari(dataset, "faceoff/hit/odd-v0", root=tmp_path / "minari")
    remaining = [episode for episode in dataset.episodes("hit") if episode.steps]
    assert [len(e.actions) for e in exported] == [episode.steps for episode in remaining]
    assert [bool(e.truncations[-1]) for e in exported] == [True] * len(remaining)
    root = fd.to_lerobot(dataset, tmp_path / "lerobot", "hit")
    rows = pq.read_table(root / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [row["source_episode"] for row in rows] == [episode.index for episode in remaining]


@pytest.mark.parametrize("task", ["hit", "defend"])
def test_lerobot_files_are_consistent(task: str, tmp_path: Path) -> None:
    dataset = fd.open_dataset(HOLD)
    root = fd.to_lerobot(dataset, tmp_path / "lerobot", task)
    info = json.loads((root / "meta/info.json").read_text())
    episodes = dataset.episodes(task)
    assert info["codebase_version"] == "v3.0" and info["fps"] == 50
    assert info["total_episodes"] == len(episodes) and info["splits"] == {"train": "0:2"}
    assert info["total_frames"] == sum(episode.steps for episode in episodes)
    data = pq.read_table(root / info["data_path"].format(chunk_index=0, file_index=0))
    assert set(data.column_names) == set(info["features"])
    widths = {"observation.state": 14, "observation.environment_state": 9 if task == "hit" else 6}
    for name, feature in info["features"].items():
        (width,) = feature["shape"]
        kind = data.schema.field(name).type
        assert widths.get(name, width) == width
        assert (kind.list_size if width > 1 else 1) == width
        part = str(kind.value_type if width > 1 else kind)
        assert {"float": "float32"}.get(part, part) == feature["dtype"]
        assert feature["names"] is None or len(feature["names"]) == width
    frames = data.to_pylist()
    rows = pq.read_table(root / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    stats = json.loads((root / "meta/stats.json").read_text())
    assert set(stats) == set(info["features"])
    for number, (episode, row) in enumerate(zip(episodes, rows, strict=True)):
        arrays = episode.to_numpy()
        own_frames = frames[row["dataset_from_index"] : row["dataset_to_index"]]
        assert len(own_frames) == row["length"] == episode.steps and row["seed"] == episode.seed
        assert {frame["episode_index"] for frame in own_frames} == {number}
        observations = arrays.observations[:-1].astype(np.float32)
        assert np.array_equal([f["observation.state"] for f in own_frames], observations[:, 6:20])
        assert np.array_equal([f["observation.environment_state"] for f in own_frames][0][:6], observations[0, :6])
        assert [f["next.done"] for f in own_frames] == [False] * (episode.steps - 1) + [True]
        assert np.allclose([f["timestamp"] for f in own_frames], np.arange(episode.steps) * 0.02)
        assert row["stats/action/count"] == [episode.steps]
        assert np.allclose(
            row["stats/observation.state/q50"], np.median(observations[:, 6:20].astype(float), axis=0)
        )
    assert [frame["index"] for frame in frames] == list(range(info["total_frames"]))
    whole = np.array([frame["action"] for frame in frames])
    assert stats["action"]["max"] == whole.max(axis=0).tolist()


def test_lerobot_tasks_are_the_index_of_a_data_frame(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    root = fd.to_lerobot(fd.open_dataset(HOLD), tmp_path / "lerobot", "hit")
    tasks = pandas.read_parquet(root / "meta/tasks.parquet")
    assert tasks.columns.tolist() == ["task_index"] and tasks.iloc[0].task_index == 0
    assert tasks.iloc[0].name == "Hit the puck into the opponent's goal."


def test_lerobot_frames_are_split_into_files(tmp_path: Path) -> None:
    dataset = fd.open_dataset(HOLD)
    root = fd.to_lerobot(dataset, tmp_path / "lerobot", "hit", data_file_mb=0)
    files = sorted(path.name for path in (root / "data/chunk-000").iterdir())
    assert files == ["file-000.parquet", "file-001.parquet"]
    rows = pq.read_table(root / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [row["data/file_index"] for row in rows] == [0, 1]
    with pytest.raises(FileExistsError, match="is there already; name another folder"):
        fd.to_lerobot(dataset, root, "hit")
    with pytest.raises(ValueError, match="task: expected one of hit, defend, got 'hits'"):
        fd.to_lerobot(dataset, tmp_path / "other", "hits")
