"""One call at a time."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

from faceoff.errors import OrderError

Method = TypeVar("Method", bound=Callable[..., Any])


class Turn:
    """Whose turn it is: the thread's that is in a method of the environment."""

    def __init__(self) -> None:
        self._lock = threading.RLock()

    def __enter__(self) -> None:
        # Never waited for: a fork may have copied a lock whose thread it has not.
        if not self._lock.acquire(blocking=False):
            raise OrderError("expected one call at a time, got one while another thread's is under way")

    def __exit__(self, *_: object) -> None:
        self._lock.release()

    def __reduce__(self) -> tuple[type[Turn], tuple[()]]:
        return Turn, ()


def alone(method: Method) -> Method:
    """A method of an object that has a ``_turn``: refused while another thread is in one."""

    @wraps(method)
    def guarded(self: Any, *args: Any, **kwargs: Any) -> Any:
        with self._turn:
            return method(self, *args, **kwargs)

    return guarded  # type: ignore[return-value]
