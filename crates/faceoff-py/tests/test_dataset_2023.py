"""The export in the layout of the 2023 challenge, for tools that were written for it."""

from __future__ import annotations

import hashlib
import json
import pickletools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pyarrow")

import faceoff.dataset as fd  # noqa: E402
from dataset_recordings import FIXTURES, hold, odd, slice_of  # noqa: E402

# The expected content of the exports of two fixtures, as `digest` gives it.
GOLDEN = Path(__file__).with_name("golden_dataset_2023.json")
GROUPS = ("joint_pos", "joint_vel", "ee", "link")


def load(path: Path) -> Any:
    return np.load(path, allow_pickle=True)


def digest(folder: Path) -> dict[str, Any]:
    """The content of each file: JSON as it is, types and hashes of arrays and transitions."""
    out: dict[str, Any] = {}
    for path in sorted(folder.rglob("*.*")):
        name = path.relative_to(folder).as_posix()
        if path.suffix == ".json":
            out[name] = json.loads(path.read_text())
        elif path.suffix == ".npy":
            array = np.load(path)
            out[name] = [array.dtype.str, list(array.shape), hashlib.sha256(array).hexdigest()]
        else:
            hash_, steps = hashlib.sha256(), load(path)
            for state, action, reward, after, absorbing, last in steps:
                for x in (state, action, after):
                    hash_.update(repr((type(x).__name__, x.dtype.str, x.shape)).encode())
                    hash_.update(x.tobytes())
                hash_.update(repr((reward, absorbing, last)).encode())
            out[name] = [type(steps).__name__, len(steps), hash_.hexdigest()]
    return out


@pytest.mark.parametrize("name", ["dataset-layout-2.zip", "dataset-layout-3.zip"])
def test_export_equals_the_golden_one(name: str, tmp_path: Path) -> None:
    fd.to_2023(fd.open_dataset(FIXTURES / name), tmp_path)
    assert digest(tmp_path) == json.loads(GOLDEN.read_text())[name]


def test_transitions_are_chained_and_equal_the_recording(tmp_path: Path) -> None:
    dataset = fd.open_dataset(hold())
    folders = fd.to_2023(dataset, tmp_path)
    assert [folder.name for folder in folders] == ["7dof-hit", "7dof-defend", "7dof-prepare"]
    for task, folder, width in zip(dataset.tasks, folders, (23, 20, 20), strict=True):
        steps = load(folder / "dataset.pkl")
        rows = [row for e in dataset.episodes(task) for row in slice_of(hold(), task, e.index)]
        observed = [name for name in dataset.table().column_names if name.startswith("obs_")]
        assert len(steps) == len(rows) == dataset.results["tasks"][task]["steps"]
        for number, ((state, action, reward, after, absorbing, last), row) in enumerate(
            zip(steps, rows, strict=True)
        ):
            expected = [row[name] for name in observed if row[name] is not None]
            assert state.shape == after.shape == (width,) and state.tolist() == expected
            assert action.shape == (2, 7) and action.reshape(-1).tolist() == row["action"]
            assert reward == 0.0
            assert last or np.array_equal(after, steps[number + 1][0])
            assert last or not absorbing
        ends = [e.end for e in dataset.episodes(task)]
        assert sum(step[5] for step in steps) == len(ends)
        assert [step[4] for step in steps if step[5]] == [end != "horizon" for end in ends]
        times = np.load(folder / "computation_time.npy")
        assert times.tolist() == [row["computation_time_ns"] / 1e9 for row in rows]
        for group in GROUPS:
            values = np.load(folder / f"{group}_constr.npy")
            assert values.shape == (len(rows), 1) and values.dtype == np.float64
            assert values[:, 0].tolist() == [row[f"constraint_{group}"] for row in rows]
    old = json.loads((tmp_path / "results.json").read_text())
    for task, folder in zip(dataset.tasks, folders, strict=True):
        new = dataset.results["tasks"][task]
        assert old[folder.name]["Success"] == new["success_rate"]
        assert old[folder.name]["Penalty"] == new["penalty_points"]
    assert old["Total Score"]["Score"] == dataset.results["score"] / 100


def test_faults_do_not_absorb_and_violations_are_counted(tmp_path: Path) -> None:
    dataset = fd.open_dataset(odd())
    fd.to_2023(dataset, tmp_path)
    steps = load(tmp_path / "7dof-hit" / "dataset.pkl")
    lasts = [number for number, step in enumerate(steps) if step[5]]
    # The episode that never began has no transition.
    assert lasts == [6, len(steps) - 1] and not any(steps[number][4] for number in lasts)
    assert steps[0][1].shape == (3, 7)
    assert load(tmp_path / "7dof-defend" / "dataset.pkl")[0][1].shape == (20, 3, 7)
    violations = json.loads((tmp_path / "7dof-hit" / "violations.json").read_text())
    summary = violations.pop("violation summary")
    episodes = dataset.episodes("hit")
    for group in GROUPS:
        violating = [e for e in episodes if group in e.violated]
        assert summary.get(f"{group}_constr", 0) == len(violating)
        for episode in violating:
            assert f"{group}_constr violated" in violations[f"Episode {episode.index}"]
    slow = [e for e in episodes if e.computation_time_max_s > 0.02 or e.computation_time_mean_s > 0.02]
    assert summary.get("Computation Time", 0) == len(slow)
    assert summary["Total"] == sum(len(messages) for messages in violations.values())


def test_pickle_names_nothing_specific_to_a_numpy_version(tmp_path: Path) -> None:
    dataset = fd.open_dataset(FIXTURES / "dataset-layout-3.zip")
    (hit, _) = fd.to_2023(dataset, tmp_path)
    named = {
        argument
        for code, argument, _ in pickletools.genops((hit / "dataset.pkl").read_bytes())
        if code.name == "GLOBAL"
    }
    assert named == {"numpy array", "__builtin__ list"}


def test_existing_export_is_not_overwritten(tmp_path: Path) -> None:
    dataset = fd.open_dataset(FIXTURES / "dataset-layout-3.zip")
    fd.to_2023(dataset, tmp_path)
    before = digest(tmp_path)
    with pytest.raises(FileExistsError, match="7dof-hit is there already; name another folder"):
        fd.to_2023(dataset, tmp_path)
    assert digest(tmp_path) == before
