"""Reads recordings of evaluations and games, and writes them in other layouts.

    import faceoff.dataset

    dataset = faceoff.dataset.open("result/")
    for episode in dataset.episodes("hit"):
        print(episode.index, episode.end, episode.success, episode.steps)
    arrays = dataset.episode("hit", 0).to_numpy()

Needs pyarrow 12 or newer (``pip install 'faceoff-robotics[dataset]'``); pandas, polars and minari only for the
functions that use them. The simulator is not needed, except by ``to_minari``.
``python -m faceoff.dataset`` does the same from the command line. The layouts are described in
``docs/dataset.md``.
"""

from __future__ import annotations

import os

from faceoff.errors import MissingError

try:
    import pyarrow as _pyarrow
except ImportError as error:
    from faceoff._distribution import install_command

    raise MissingError(f"faceoff.dataset needs pyarrow: {install_command('dataset')}") from error

from ._container import MANIFEST as _MANIFEST
from ._container import find as _find
from ._dataset import LAYOUTS, Dataset
from ._episode import ACTION_SHAPES, CONSTRAINTS, Episode, EpisodeArrays
from ._errors import DatasetError, ExistsError
from ._game import GAME_LAYOUTS, Game, Rally, SideArrays
from ._layout_2023 import to_2023
from ._lerobot import to_lerobot
from ._minari import to_minari
from ._parquet import to_parquet
from ._rewards import Reward, success_at_end

__all__ = [
    "ACTION_SHAPES",
    "CONSTRAINTS",
    "GAME_LAYOUTS",
    "LAYOUTS",
    "Dataset",
    "DatasetError",
    "Episode",
    "EpisodeArrays",
    "ExistsError",
    "Game",
    "Rally",
    "Reward",
    "SideArrays",
    "open",
    "open_dataset",
    "open_game",
    "success_at_end",
    "to_2023",
    "to_lerobot",
    "to_minari",
    "to_parquet",
]

del _pyarrow


def open(path: str | os.PathLike[str]) -> Dataset | Game:
    """Opens a recording: `dataset.zip`, `game.zip`, the file of one side, a folder with the unpacked
    content of one of these, or the output folder of `faceoff eval` or `faceoff play`.

    Only the manifest is read; tables are read on demand, in place.

    Raises:
        DatasetError: the recording does not exist or is damaged.
    """
    container = _find(path)
    manifest = container.json(_MANIFEST)
    if manifest.get("schema") in GAME_LAYOUTS:
        return Game(container, manifest)
    return Dataset(container, manifest)


def open_dataset(path: str | os.PathLike[str]) -> Dataset:
    """Like `open`, for the recording of an evaluation only.

    Raises:
        DatasetError: it cannot be read, or is a game.
    """
    recording = open(path)
    if isinstance(recording, Game):
        raise DatasetError(f"{recording.path}: expected the dataset of an evaluation, got a game")
    return recording


def open_game(path: str | os.PathLike[str]) -> Game:
    """Like `open`, for the recording of a game only.

    Raises:
        DatasetError: it cannot be read, or is the dataset of an evaluation.
    """
    recording = open(path)
    if isinstance(recording, Dataset):
        raise DatasetError(f"{recording.path}: expected a game, got the dataset of an evaluation")
    return recording
