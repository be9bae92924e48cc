"""Selects the episodes of a dataset for a conversion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Iterable

from faceoff.errors import ArgumentError

from ._dataset import Dataset
from ._episode import Episode
from ._errors import DatasetError

__all__ = ["Selection", "select"]


@dataclass(frozen=True)
class Selection:
    """Episodes of one task whose actions have one shape, each with at least one control step."""

    task: str
    action_shape: tuple[int, ...]
    episodes: list[Episode]


def select(dataset: Dataset, task: str, episodes: Iterable[Episode] | None) -> Selection:
    """Selects the episodes for learning: those with at least one answered step.

    Raises:
        ArgumentError: an episode is of another task.
        DatasetError: no episode remains, or their actions have different shapes.
    """
    selected = dataset.episodes(task) if episodes is None else list(episodes)
    for episode in selected:
        if episode.task != task:
            raise ArgumentError(f"episodes: expected episodes of {task}, got one of {episode.task}")
    selected = [episode for episode in selected if episode.steps]
    if not selected:
        raise DatasetError(f"{dataset.path}: expected an answered control step of {task}, found none")
    shapes = sorted({episode.action_shape for episode in selected})
    if len(shapes) > 1:
        raise DatasetError(
            f"{dataset.path}: expected actions of {task} of one shape, got {shapes}; "
            "choose episodes of one interpolation with the argument `episodes`"
        )
    return Selection(task, shapes[0], selected)
