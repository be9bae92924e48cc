"""A window that shows pictures at the pace of the table."""

from __future__ import annotations

import time

import numpy as np
import numpy.typing as npt

from faceoff.errors import MissingError


class Window:
    """A window of tkinter's, which comes with Python or as the system's package python3-tk.

    Raises:
        MissingError: if there is no tkinter, or no display to show it on.
    """

    def __init__(self, title: str, frames_per_second: int) -> None:
        try:
            import tkinter
        except ImportError as error:
            raise MissingError(
                "render_mode='human' needs tkinter: install the system's package python3-tk, or use 'rgb_array'"
            ) from error
        try:
            self._root = tkinter.Tk()
        except tkinter.TclError as error:
            raise MissingError(
                f"render_mode='human' needs a display ({error}): use 'rgb_array' where there is none"
            ) from error
        self._root.title(title)
        self._label = tkinter.Label(self._root, borderwidth=0)
        self._label.pack()
        self._new_image = tkinter.PhotoImage
        self._pause_s = 1.0 / frames_per_second
        self._next_s = time.monotonic()
        self._is_open = True
        self._root.protocol("WM_DELETE_WINDOW", self.close)

    def show(self, picture: npt.NDArray[np.uint8]) -> None:
        """Shows a picture, (height, width, 3), when it is due; a window that the user has closed shows nothing."""
        if not self._is_open:
            return
        height, width, _ = picture.shape
        image = self._new_image(data=b"P6 %d %d 255\n" % (width, height) + picture.tobytes())
        self._label.configure(image=image)
        # tkinter keeps no reference of its own.
        self._image = image
        self._root.update()
        now = time.monotonic()
        self._next_s = max(self._next_s + self._pause_s, now)
        time.sleep(self._next_s - now)

    def close(self) -> None:
        """Takes the window away; may be called again."""
        if self._is_open:
            self._is_open = False
            self._root.destroy()
