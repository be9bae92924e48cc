"""Minari datasets, for offline learners of the Farama ecosystem."""

from __future__ import annotations

import os
import warnings
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Iterable, Iterator

import numpy as np

from faceoff.errors import ArgumentError, MissingError

from ._dataset import Dataset
from ._episode import Episode
from ._rewards import Reward, rewards_of, success_at_end
from ._select import select

__all__ = ["to_minari"]

# The protocol's bound of numbers in an answer.
ACTION_MAX = 1e4
ROOT = "MINARI_DATASETS_PATH"


def to_minari(
    dataset: Dataset,
    dataset_id: str,
    *,
    task: str | None = None,
    episodes: Iterable[Episode] | None = None,
    reward: Reward = success_at_end,
    root: str | os.PathLike[str] | None = None,
    data_format: str = "arrow",
    dtype: str = "float32",
    **about: Any,
) -> Any:
    """Writes the episodes of one task as a Minari dataset, which `minari.load_dataset` finds.

    An episode of N control steps has N + 1 observations, N actions, rewards, terminations and
    truncations. Observations and actions are those of the protocol, flat: shapes (N + 1, 20), with an
    opponent (N + 1, 23), and (N, 7), (N, 14), (N, 21) or (N, 420) by the interpolation. An episode that
    the horizon or a fault of the agent ended is truncated, any other is terminated. `infos` has
    `computation_time_s`, `constraints` and `puck` (true, after the step), one per observation, NaN with
    the first. The metadata of each episode has its `seed_hex`, `end`, `success` and number. Episodes
    without an answered step are left out.

    Args:
        dataset: what is converted.
        dataset_id: e.g. ``faceoff/hit/striker-v0``.
        task: `hit`, `defend` or `prepare`; if it is left out, the only task, or the one that the id names
            as a part.
        episodes: only these; None for all of the task.
        reward: gives an episode's rewards; the evaluation itself knows none.
        root: folder for datasets in place of ``MINARI_DATASETS_PATH`` or Minari's own.
        data_format: `arrow`, `parquet` or `hdf5`, as Minari knows them.
        dtype: `float32` or `float64`.
        about: of ``minari.create_dataset_from_buffers``, e.g. `author`, `description`, `env`.

    Returns:
        The `minari.MinariDataset`.

    Raises:
        ArgumentError: the task is not said or not known.
        ValueError: Minari refuses an argument, or an id that exists.
        DatasetError: the dataset is damaged, or actions have different shapes.
        MissingError: Minari or Pillow is not installed.
    """
    try:
        import minari
        import PIL  # noqa: F401 - Minari's Arrow storage needs it and does not say so
        from gymnasium.spaces import Box
        from minari.data_collector import EpisodeBuffer
    except ImportError as error:
        raise MissingError(
            "to_minari needs Minari, Gymnasium and Pillow: pip install minari pillow"
        ) from error
    if dtype not in ("float32", "float64"):
        raise ArgumentError(f"dtype: expected 'float32' or 'float64', got {dtype!r}")
    chosen = select(dataset, _task(dataset, dataset_id, task), episodes)
    number = np.dtype(dtype).type
    width = int(np.prod(chosen.action_shape))
    buffers = [_buffer(EpisodeBuffer, episode, reward, number) for episode in chosen.episodes]
    observed = buffers[0].observations.shape[1]
    about = {
        "algorithm_name": dataset.agent,
        "description": f"Agent {dataset.agent} in {chosen.task}, profile {dataset.profile}, "
        f"ruleset {dataset.ruleset}",
        **about,
    }
    with _datasets_root(root), warnings.catch_warnings():
        # It warns of each field about the author that is left out.
        warnings.filterwarnings("ignore", message=".*(is set to None|env_spec is None)", category=UserWarning)
        made = minari.create_dataset_from_buffers(
            dataset_id=dataset_id,
            buffer=buffers,
            observation_space=Box(-np.inf, np.inf, (observed,), number),
            action_space=Box(-ACTION_MAX, ACTION_MAX, (width,), number),
            data_format=data_format,
            **about,
        )
        made.storage.update_episode_metadata(
            [
                {
                    "seed_hex": episode.seed,
                    "end": episode.end,
                    "success": episode.success,
                    "task": episode.task,
                    "source_episode": episode.index,
                }
                for episode in chosen.episodes
            ]
        )
    return made


def _task(dataset: Dataset, dataset_id: str, task: str | None) -> str:
    if task is not None:
        return task
    if len(dataset.tasks) == 1:
        return dataset.tasks[0]
    named = [part for part in dataset_id.split("/") if part in dataset.tasks]
    if len(named) == 1:
        return named[0]
    raise ArgumentError(f"task: expected one of {', '.join(dataset.tasks)}, got none")


def _buffer(kind: Any, episode: Episode, reward: Reward, number: type[Any]) -> Any:
    arrays = episode.to_numpy()
    steps = episode.steps
    flags = np.zeros((2, steps), dtype=bool)
    flags[:, -1] = episode.terminated, episode.truncated
    nothing = np.full((1, arrays.constraints.shape[1]), np.nan)
    return kind(
        observations=arrays.observations.astype(number),
        actions=arrays.actions.reshape(steps, -1).astype(number),
        rewards=rewards_of(reward, episode, arrays),
        terminations=flags[0],
        truncations=flags[1],
        infos={
            "computation_time_s": np.concatenate([[np.nan], arrays.computation_time_s])[:, None],
            "constraints": np.concatenate([nothing, arrays.constraints]),
            "puck": arrays.puck,
        },
    )


@contextmanager
def _datasets_root(root: str | os.PathLike[str] | None) -> Iterator[None]:
    """Minari knows its folder by an environment variable only."""
    if root is None:
        yield
        return
    before = os.environ.get(ROOT)
    os.environ[ROOT] = str(Path(root).absolute())
    try:
        yield
    finally:
        if before is None:
            del os.environ[ROOT]
        else:
            os.environ[ROOT] = before
