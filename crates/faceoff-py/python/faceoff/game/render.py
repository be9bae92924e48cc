"""Pictures of games."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from faceoff import _native
from faceoff.errors import ArgumentError
from faceoff.gym.reward import State


def draw_game(state: Sequence[float]) -> npt.NDArray[np.uint8]:
    """A picture of a game's true state, (40,), from above: (360, 640, 3) uint8."""
    from faceoff.gym.render import draw

    # A game's state has the puck (6) and 17 numbers for each robot; `draw` takes the state of a task's world. Both have
    # the puck, and the end effectors of robot 1 and robot 2.
    array = np.zeros(_native.STATE_LEN)
    array[:6], array[27:30], array[30:33] = state[:6], state[20:23], state[37:40]
    return draw(State(array), has_opponent=True)


class GameView:
    """Shows a game as its render mode says. Its window is not part of a pickle."""

    def __init__(self, title: str, render_mode: str | None, fps: int) -> None:
        self._title, self._render_mode, self._fps = title, render_mode, fps
        self._window: Any = None

    def show(self, state: Sequence[float]) -> npt.NDArray[np.uint8] | None:
        """A picture for ``rgb_array``; None for ``human``, which shows a window."""
        if self._render_mode is None:
            raise ArgumentError(
                "render: expected an environment made with render_mode='rgb_array' or 'human', got None"
            )
        frame = draw_game(state)
        if self._render_mode == "rgb_array":
            return frame
        if self._window is None:
            from faceoff.gym.window import Window

            self._window = Window(self._title, self._fps)
        self._window.show(frame)
        return None

    def close(self) -> None:
        """Closes the window."""
        if self._window is not None:
            self._window.close()
            self._window = None

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_window": None}
