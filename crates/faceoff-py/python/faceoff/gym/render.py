"""Pictures of the table from above, drawn with NumPy alone."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from faceoff.gym.reward import State
from faceoff.kinematics import model

#: Size of a picture, pixels.
HEIGHT, WIDTH = 360, 640
#: Metres per pixel: the table with a margin.
SCALE = 2.16 / WIDTH

#: Of the table, m.
HALF_LENGTH, HALF_WIDTH, HALF_GOAL = model.TABLE_LENGTH_M / 2, model.TABLE_WIDTH_M / 2, model.GOAL_WIDTH_M / 2

#: Of the painted circle in the middle, m.
CENTRE_CIRCLE_RADIUS = 0.15

#: Colours: red, green, blue.
FLOOR = (58, 64, 72)
TABLE = (238, 241, 244)
LINES = (176, 190, 204)
GOALS = (208, 96, 72)
PUCK = (24, 26, 30)
OWN_MALLET = (32, 110, 190)
OTHER_MALLET = (200, 120, 30)

Picture = npt.NDArray[np.uint8]


@lru_cache(maxsize=1)
def _grid() -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """x of each column (1, WIDTH) and y of each row (HEIGHT, 1), m."""
    x = (np.arange(WIDTH) + 0.5 - WIDTH / 2) * SCALE
    y = (HEIGHT / 2 - np.arange(HEIGHT) - 0.5) * SCALE
    return x[None, :], y[:, None]


@lru_cache(maxsize=1)
def _table() -> Picture:
    x, y = _grid()
    picture = np.empty((HEIGHT, WIDTH, 3), np.uint8)
    picture[:] = FLOOR
    picture[(np.abs(x) <= HALF_LENGTH) & (np.abs(y) <= HALF_WIDTH)] = TABLE
    middle = (np.abs(x) < SCALE) & (np.abs(y) <= HALF_WIDTH)
    circle = np.abs(np.hypot(x, y) - CENTRE_CIRCLE_RADIUS) < SCALE
    picture[middle | circle] = LINES
    picture[(np.abs(np.abs(x) - HALF_LENGTH) < 3 * SCALE) & (np.abs(y) <= HALF_GOAL)] = GOALS
    return picture


def _disc(picture: Picture, x_m: float, y_m: float, radius_m: float, colour: tuple[int, int, int]) -> None:
    x, y = _grid()
    picture[np.hypot(x - x_m, y - y_m) <= radius_m] = colour


def draw(state: State, *, has_opponent: bool) -> Picture:
    """(360, 640, 3) uint8: the table, the puck with a mark that shows its yaw, and the mallets."""
    picture = _table().copy()
    own_x, own_y, _ = state.mallet
    _disc(picture, own_x - model.BASE_X_M, own_y, model.MALLET_RADIUS_M, OWN_MALLET)
    if has_opponent:
        x, y, _ = state.opponent
        _disc(picture, model.BASE_X_M - x, -y, model.MALLET_RADIUS_M, OTHER_MALLET)
    x, y, yaw = state.puck[:3]
    _disc(picture, x, y, model.PUCK_RADIUS_M, PUCK)
    mark = 0.6 * model.PUCK_RADIUS_M
    _disc(picture, x + mark * np.cos(yaw), y + mark * np.sin(yaw), 0.25 * model.PUCK_RADIUS_M, TABLE)
    return picture
