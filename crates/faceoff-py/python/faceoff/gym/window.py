"""A window that shows pictures in simulated real time."""

from __future__ import annotations

import time
import warnings

import numpy as np
import numpy.typing as npt


class Window:
    """A tkinter window; tkinter comes with Python or as the system's package python3-tk.

    Without tkinter or a display it shows nothing and warns once, so that checks of an environment, which try all render
    modes, also work on servers.
    """

    def __init__(self, title: str, frames_per_second: int) -> None:
        self._is_open = False
        try:
            import tkinter

            self._root = tkinter.Tk()
        except (ImportError, RuntimeError) as error:
            _warn("tkinter", f"{error}; install the system's package python3-tk")
            return
        except Exception as error:  # tkinter.TclError, whose module may be missing
            _warn("a display", str(error))
            return
        self._root.title(title)
        self._label = tkinter.Label(self._root, borderwidth=0)
        self._label.pack()
        self._new_image = tkinter.PhotoImage
        self._pause_s = 1.0 / frames_per_second
        self._next_s = time.monotonic()
        self._is_open = True
        self._root.protocol("WM_DELETE_WINDOW", self.close)

    def show(self, picture: npt.NDArray[np.uint8]) -> None:
        """Shows a picture, (height, width, 3), at its time; does nothing after the user has closed the window."""
        if not self._is_open:
            return
        height, width, _ = picture.shape
        image = self._new_image(data=b"P6 %d %d 255\n" % (width, height) + picture.tobytes())
        self._label.configure(image=image)
        # tkinter keeps no reference to it.
        self._image = image
        self._root.update()
        now = time.monotonic()
        self._next_s = max(self._next_s + self._pause_s, now)
        time.sleep(self._next_s - now)

    def close(self) -> None:
        """Closes the window; may be called more than once."""
        if self._is_open:
            self._is_open = False
            self._root.destroy()


def _warn(missing: str, reason: str) -> None:
    warnings.warn(
        f"render_mode='human' needs {missing} and shows nothing ({reason}): use 'rgb_array' where there is none",
        RuntimeWarning,
        stacklevel=4,
    )
