"""Export as a Minari dataset, for offline learning in the Farama ecosystem."""

from __future__ import annotations

import copy
import json
import os
import warnings
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Iterable, Iterator, Sequence

import numpy as np

from faceoff.errors import ArgumentError, MissingError

from ._dataset import Dataset
from ._episode import Episode
from ._rewards import Reward, checked_rewards, success_at_end
from ._select import select

__all__ = ["to_minari"]

# The protocol's bound for numbers in an action.
ACTION_MAX = 1e4
# The environment variable with Minari's folder of datasets.
ROOT_VARIABLE = "MINARI_DATASETS_PATH"


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
    **metadata: Any,
) -> Any:
    """Writes the episodes of one task as a Minari dataset for `minari.load_dataset`.

    An episode of N control steps has N + 1 observations, N actions, rewards, terminations and
    truncations. Observations and actions are those of the protocol, flat: shapes (N + 1, 20), with an
    opponent (N + 1, 23), and (N, 7), (N, 14), (N, 21) or (N, 420) by the interpolation. An episode that
    ends at the horizon or by an agent fault is truncated, any other is terminated. `infos` has
    `computation_time_s`, `constraints` and `puck` (true, after the step), one per observation; the
    first is NaN. `recover_environment()` returns the environment with the perturbations and the robot of the dataset,
    in which recorded actions can be played. The metadata of each episode has its `seed_hex`, `end`, `success` and number. Episodes
    without an answered step are left out.

    Args:
        dataset: the dataset to convert.
        dataset_id: e.g. ``faceoff/hit/striker-v0``.
        task: `hit`, `defend` or `prepare`; by default the only task, or the one named in a part of the id.
        episodes: the episodes to convert; None for all of the task.
        reward: computes the rewards of an episode; the evaluation has none.
        root: folder for datasets instead of ``MINARI_DATASETS_PATH`` or Minari's default.
        data_format: a format of Minari: `arrow`, `parquet` or `hdf5`.
        dtype: `float32` or `float64`.
        metadata: further arguments of ``minari.create_dataset_from_buffers``, e.g. `author`, `description`, `env`.

    Returns:
        The `minari.MinariDataset`.

    Raises:
        ArgumentError: the task is missing or unknown.
        ValueError: Minari refuses an argument, or an id that exists.
        DatasetError: the dataset is damaged, or actions have different shapes.
        MissingError: Minari or Pillow is not installed.
    """
    try:
        import minari
        import PIL  # noqa: F401 - an undeclared dependency of Minari's Arrow storage
        from gymnasium.spaces import Box
        from minari.data_collector import EpisodeBuffer
    except ImportError as error:
        raise MissingError(
            "to_minari needs Minari, Gymnasium and Pillow: pip install minari pillow"
        ) from error
    if dtype not in ("float32", "float64"):
        raise ArgumentError(f"dtype: expected 'float32' or 'float64', got {dtype!r}")
    selection = select(dataset, _find_task(dataset, dataset_id, task), episodes)
    scalar = np.dtype(dtype).type
    width = int(np.prod(selection.action_shape))
    buffers = [_buffer(EpisodeBuffer, episode, reward, scalar) for episode in selection.episodes]
    observation_len = buffers[0].observations.shape[1]
    metadata = {
        "env": _environment(dataset, selection.task, selection.episodes),
        "algorithm_name": dataset.agent,
        "description": f"Agent {dataset.agent} in {selection.task}, profile {dataset.profile}, "
        f"ruleset {dataset.ruleset}",
        **metadata,
    }
    with _datasets_root(root), warnings.catch_warnings():
        # Minari warns of each missing field about the author.
        warnings.filterwarnings("ignore", message=".*(is set to None|env_spec is None)", category=UserWarning)
        exported = minari.create_dataset_from_buffers(
            dataset_id=dataset_id,
            buffer=buffers,
            observation_space=Box(-np.inf, np.inf, (observation_len,), scalar),
            action_space=Box(-ACTION_MAX, ACTION_MAX, (width,), scalar),
            data_format=data_format,
            **metadata,
        )
        exported.storage.update_episode_metadata(
            [
                {
                    "seed_hex": episode.seed,
                    "end": episode.end,
                    "success": episode.success,
                    "task": episode.task,
                    "source_episode": episode.index,
                }
                for episode in selection.episodes
            ]
        )
    return exported


def _environment(dataset: Dataset, task: str, episodes: Sequence[Episode]) -> Any:
    """The specification of an environment that takes the recorded actions, None if there is no single one."""
    import gymnasium

    import faceoff.gym  # noqa: F401 - registers the environments
    from faceoff._arguments import PROFILES

    codes = {json.loads(episode.interpolation) for episode in episodes if episode.interpolation is not None}
    if len(codes) != 1 or dataset.profile not in PROFILES:
        return None
    spec = copy.deepcopy(gymnasium.spec(f"faceoff/AirHockey-{task.capitalize()}-v0"))
    spec.kwargs |= {
        "action_mode": "raw",
        "interpolation": codes.pop(),
        "profile": dataset.profile,
        "mismatch_seed": dataset.mismatch_seed,
    }
    if "perturbations" in dataset.manifest:
        spec.kwargs["perturbations"] = dataset.manifest["perturbations"]
    return spec


def _find_task(dataset: Dataset, dataset_id: str, task: str | None) -> str:
    if task is not None:
        return task
    if len(dataset.tasks) == 1:
        return dataset.tasks[0]
    named = [part for part in dataset_id.split("/") if part in dataset.tasks]
    if len(named) == 1:
        return named[0]
    raise ArgumentError(f"task: expected one of {', '.join(dataset.tasks)}, got none")


def _buffer(buffer_class: Any, episode: Episode, reward: Reward, scalar: type[Any]) -> Any:
    """An episode as Minari's class of buffers; observations and actions are of NumPy's type `scalar`."""
    arrays = episode.to_numpy()
    steps = episode.steps
    flags = np.zeros((2, steps), dtype=bool)
    flags[:, -1] = episode.terminated, episode.truncated
    missing = np.full((1, arrays.constraints.shape[1]), np.nan)
    return buffer_class(
        observations=arrays.observations.astype(scalar),
        actions=arrays.actions.reshape(steps, -1).astype(scalar),
        rewards=checked_rewards(reward, episode, arrays),
        terminations=flags[0],
        truncations=flags[1],
        infos={
            "computation_time_s": np.concatenate([[np.nan], arrays.computation_time_s])[:, None],
            "constraints": np.concatenate([missing, arrays.constraints]),
            "puck": arrays.puck,
        },
    )


@contextmanager
def _datasets_root(root: str | os.PathLike[str] | None) -> Iterator[None]:
    """Sets the environment variable with Minari's folder, which has no other setting."""
    if root is None:
        yield
        return
    before = os.environ.get(ROOT_VARIABLE)
    os.environ[ROOT_VARIABLE] = str(Path(root).absolute())
    try:
        yield
    finally:
        if before is None:
            del os.environ[ROOT_VARIABLE]
        else:
            os.environ[ROOT_VARIABLE] = before
