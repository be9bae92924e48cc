"""Recordings of evaluations and games in Python: reading them, and writing them in other layouts.

    import faceoff.dataset

    dataset = faceoff.dataset.open("result/")
    for episode in dataset.episodes("hit"):
        print(episode.index, episode.end, episode.success, episode.steps)
    arrays = dataset.episode("hit", 0).to_numpy()

Needs pyarrow 12 or newer (``pip install 'faceoff[dataset]'``); pandas, polars and minari only where they
are asked for. It does not need the simulator: nothing here imports ``faceoff._native``.
``python -m faceoff.dataset`` does the same from the command line. The layouts are described in
``docs/dataset.md``.
"""

from __future__ import annotations

import os

from faceoff.errors import MissingError

try:
    import pyarrow as _pyarrow
except ImportError as error:
    raise MissingError("faceoff.dataset needs pyarrow: pip install 'faceoff[dataset]'") from error

from ._container import MANIFEST as _MANIFEST
from ._container import find as _find
from ._dataset import LAYOUTS, Dataset
from ._episode import ACTION_SHAPES, CONSTRAINTS, Episode, EpisodeArrays
from ._errors import DatasetError, ExistsError
from ._game import GAME_LAYOUTS, Game, Rally, SideArrays
from ._layout_2023 import to_2023
from ._lerobot import to_lerobot
from ._minari import to_minari
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
]

del _pyarrow


def open(path: str | os.PathLike[str]) -> Dataset | Game:
    """Opens a recording: `dataset.zip`, `game.zip`, a side's own file, a folder that one of these was
    unpacked to, or the folder that `faceoff eval` or `faceoff play` wrote.

    Only the manifest is read; tables are read as they are asked for, in place.

    Raises:
        DatasetError: there is none, or it is damaged.
    """
    container = _find(path)
    manifest = container.json(_MANIFEST)
    if manifest.get("schema") in GAME_LAYOUTS:
        return Game(container, manifest)
    return Dataset(container, manifest)


def open_dataset(path: str | os.PathLike[str]) -> Dataset:
    """As `open`, for whoever expects an evaluation.

    Raises:
        DatasetError: it cannot be read, or is a game.
    """
    found = open(path)
    if isinstance(found, Game):
        raise DatasetError(f"{found.path}: expected the dataset of an evaluation, got a game")
    return found


def open_game(path: str | os.PathLike[str]) -> Game:
    """As `open`, for whoever expects a game.

    Raises:
        DatasetError: it cannot be read, or is the dataset of an evaluation.
    """
    found = open(path)
    if isinstance(found, Dataset):
        raise DatasetError(f"{found.path}: expected a game, got the dataset of an evaluation")
    return found
