"""Export in the layout of the 2023 challenge, for tools written for it."""

from __future__ import annotations

import json
import os
import pickle
from pathlib import Path
from typing import Any, BinaryIO, Iterable, Iterator

import numpy as np

from ._dataset import Dataset
from ._episode import CONSTRAINTS, Episode
from ._errors import ExistsError

__all__ = ["ENVIRONMENTS", "to_2023"]

ENVIRONMENTS = {"hit": "7dof-hit", "defend": "7dof-defend", "prepare": "7dof-prepare"}
"""Names of the tasks in 2023."""

# Codes of the tiers, how safe the agent is for a real robot.
TIERS = {"deployable": 0, "improvable": 1, "non_deployable": 2}
# The oldest pickle protocol that supports these types.
PICKLE_PROTOCOL = 2
# Key of the group of constraints on the agent's time.
TIME = "Computation Time"

Transition = tuple[Any, Any, float, Any, bool, bool]


def to_2023(dataset: Dataset, out: str | os.PathLike[str]) -> list[Path]:
    """Writes a folder per task, and `results.json` beside them.

    Each folder holds `dataset.pkl`, a pickled list of ``(state, action, reward, next_state, absorbing,
    last)`` per control step; `computation_time.npy`, shape (steps,); for each constraint group its
    largest value per step, e.g. `ee_constr.npy`, shape (steps, 1); and `violations.json`. Any version of
    NumPy since 2023 can read the pickle and the arrays.

    Args:
        dataset: its files are compared with their hashes first.
        out: a folder, created if necessary.

    Returns:
        The folders.

    Raises:
        DatasetError: the dataset is damaged.
        ExistsError: a folder of the export exists already.
    """
    dataset.check()
    root = Path(out)
    folders = [root / ENVIRONMENTS[task] for task in dataset.tasks]
    for folder in folders:
        if folder.exists():
            raise ExistsError(f"out: {folder} is there already; name another folder")
    for task, folder in zip(dataset.tasks, folders):
        folder.mkdir(parents=True)
        _write_task(folder, dataset.episodes(task))
    _write_json(root / "results.json", _results(dataset.results))
    return folders


def _write_task(folder: Path, episodes: list[Episode]) -> None:
    times: list[Any] = []
    constraints: list[Any] = []

    def transitions() -> Iterator[Transition]:
        for episode in episodes:
            arrays = episode.to_numpy()
            times.append(arrays.computation_time_s)
            constraints.append(arrays.constraints)
            for step, action in enumerate(arrays.actions):
                last = step + 1 == episode.steps
                yield (
                    arrays.observations[step],
                    action,
                    0.0,  # The challenge's evaluation had no rewards.
                    arrays.observations[step + 1],
                    last and episode.terminated,
                    last,
                )

    with open(folder / "dataset.pkl", "wb") as file:
        dump_transitions(file, transitions())
    np.save(folder / "computation_time.npy", np.concatenate([np.zeros(0), *times]))
    values = np.concatenate([np.zeros((0, len(CONSTRAINTS))), *constraints])
    for index, group in enumerate(CONSTRAINTS):
        np.save(folder / f"{group}_constr.npy", values[:, index : index + 1])
    _write_json(folder / "violations.json", _violations(episodes))


class _StreamedList:
    """Pickles an iterable as a list, item by item, without keeping items in memory."""

    def __init__(self, items: Iterable[Any]) -> None:
        self.items = items

    def __reduce__(self) -> tuple[Any, ...]:
        return list, (), None, iter(self.items)


class _Pickler(pickle.Pickler):
    """Writes arrays as calls of `numpy.array`. NumPy's own pickles name modules that moved between NumPy 1
    and 2, so neither can read those of the other."""

    def reducer_override(self, value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return np.array, (value.tolist(),)
        return NotImplemented


def dump_transitions(file: BinaryIO, transitions: Iterable[Transition]) -> None:
    """Pickles a list of transitions that need not be in memory at once."""
    pickler = _Pickler(file, protocol=PICKLE_PROTOCOL)
    # No object occurs twice; without this the pickler would keep a reference to each.
    pickler.fast = True
    pickler.dump(_StreamedList(transitions))


def _violations(episodes: list[Episode]) -> dict[str, Any]:
    """Violations per episode and their counts, in the format of 2023."""
    out: dict[str, Any] = {}
    counts = {f"{group}_constr": 0 for group in CONSTRAINTS} | {TIME: 0}
    for episode in episodes:
        groups = [f"{group}_constr" for group in CONSTRAINTS if group in episode.violated]
        messages = [f"{group} violated" for group in groups]
        slow = _slow_message(episode.computation_time_mean_s, episode.computation_time_max_s)
        if slow is not None:
            groups.append(TIME)
            messages.append(slow)
        for group in groups:
            counts[group] += 1
        if messages:
            out[f"Episode {episode.index}"] = messages
    summary = {group: count for group, count in counts.items() if count}
    out["violation summary"] = summary | {"Total": sum(counts.values())}
    return out


def _slow_message(mean_s: float, max_s: float) -> str | None:
    """The message of 2023 about the slowness that costs most; None if the answers were fast enough."""
    if max_s > 0.2:
        return "max computation_time > 0.2s"
    if mean_s > 0.02:
        return "mean computation_time > 0.02s"
    if max_s > 0.1:
        return "max computation_time > 0.1s"
    if max_s > 0.02:
        return "max computation_time > 0.02s"
    return None


def _results(results: dict[str, Any]) -> dict[str, Any]:
    out: dict[str, Any] = {
        ENVIRONMENTS[task]: {
            "Success": result["success_rate"],
            "Penalty": result["penalty_points"],
            "Color": TIERS[result["tier"]],
        }
        for task, result in results["tasks"].items()
    }
    out["Total Score"] = {
        "Score": results["score"] / 100.0,
        "Max Penalty": results["penalty_points"],
        "Color": TIERS[results["tier"]],
    }
    return out


def _write_json(path: Path, value: dict[str, Any]) -> None:
    path.write_text(json.dumps(value, indent=2) + "\n")
