"""LeRobot itself opens the exports of `faceoff.dataset.to_lerobot`.

Runs in a separate environment (`requirements.txt`), without network.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

os.environ["HF_HUB_OFFLINE"] = "1"
lerobot_dataset = pytest.importorskip("lerobot.datasets.lerobot_dataset")

from faceoff.dataset import open_dataset, to_lerobot  # noqa: E402

FIXTURES = Path(__file__).parents[3] / "tests" / "fixtures"


@pytest.fixture(autouse=True)
def _cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    datasets = pytest.importorskip("datasets")
    monkeypatch.setattr(datasets.config, "HF_DATASETS_CACHE", tmp_path / "cache")


@pytest.mark.parametrize("task", ["hit", "defend"])
def test_lerobot_reads_every_frame(task: str, tmp_path: Path) -> None:
    dataset = open_dataset(FIXTURES / "dataset-layout-3.zip")
    root = to_lerobot(dataset, tmp_path / task, task)
    read = lerobot_dataset.LeRobotDataset(f"faceoff/{task}", root=root)
    episodes = dataset.episodes(task)
    assert read.num_episodes == len(episodes)
    assert read.num_frames == sum(episode.steps for episode in episodes)
    assert read.fps == 50 and not read.meta.video_keys
    frame = 0
    for number, episode in enumerate(episodes):
        arrays = episode.to_numpy()
        assert read.meta.episodes[number]["dataset_from_index"] == frame
        for step in (0, 1, episode.steps - 1):
            item = read[frame + step]
            observation = arrays.observations[step].astype(np.float32)
            assert np.array_equal(item["observation.state"].numpy(), observation[6:20])
            expected = np.concatenate([observation[:6], observation[20:]])
            assert np.array_equal(item["observation.environment_state"].numpy(), expected)
            action = arrays.actions[step].reshape(-1).astype(np.float32)
            assert np.array_equal(item["action"].numpy(), action)
            assert int(item["episode_index"]) == number and int(item["frame_index"]) == step
            assert bool(item["next.done"]) == (step + 1 == episode.steps)
            assert item["task"] == read.meta.tasks.iloc[0].name
        frame += episode.steps


def test_lerobot_loads_chosen_episodes_with_a_history(tmp_path: Path) -> None:
    dataset = open_dataset(FIXTURES / "dataset-layout-3.zip")
    # Small files: an episode each.
    root = to_lerobot(dataset, tmp_path / "hit", "hit", data_file_mb=0)
    assert len(list((root / "data").rglob("*.parquet"))) == 2
    read = lerobot_dataset.LeRobotDataset(
        "faceoff/hit", root=root, episodes=[1], delta_timestamps={"action": [0.0, 0.02, 0.04]}
    )
    arrays = dataset.episode("hit", 1).to_numpy()
    assert read.num_frames == len(arrays.actions)
    expected = arrays.actions[:3].reshape(3, -1).astype(np.float32)
    assert np.array_equal(read[0]["action"].numpy(), expected)


def test_lerobot_statistics_equal_those_of_the_frames(tmp_path: Path) -> None:
    dataset = open_dataset(FIXTURES / "dataset-layout-3.zip")
    root = to_lerobot(dataset, tmp_path / "hit", "hit")
    stats = lerobot_dataset.LeRobotDataset("faceoff/hit", root=root).meta.stats
    states = np.concatenate([e.to_numpy().observations[:-1, 6:20] for e in dataset.episodes("hit")])
    states = states.astype(np.float32).astype(np.float64)
    assert np.allclose(stats["observation.state"]["mean"], states.mean(axis=0))
    assert np.allclose(stats["observation.state"]["std"], states.std(axis=0))
    assert np.array_equal(stats["observation.state"]["count"], [len(states)])
