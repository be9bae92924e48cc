"""Refuses a call of an environment's method while another thread's call is under way."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

from faceoff.errors import OrderError

Method = TypeVar("Method", bound=Callable[..., Any])


class CallGuard:
    """Lock of the thread that runs a method of the environment; reentrant for that thread."""

    def __init__(self) -> None:
        self._lock = threading.RLock()

    def __enter__(self) -> None:
        # It never waits: a fork may have copied a lock that is held by a thread which does not exist here.
        if not self._lock.acquire(blocking=False):
            raise OrderError("expected one call at a time, got one while another thread's is under way")

    def __exit__(self, *_: object) -> None:
        self._lock.release()

    def __reduce__(self) -> tuple[type[CallGuard], tuple[()]]:
        return CallGuard, ()


def exclusive(method: Method) -> Method:
    """Decorates a method of an object with a ``_calls`` guard: it is refused while another thread runs one."""

    @wraps(method)
    def guarded(self: Any, *args: Any, **kwargs: Any) -> Any:
        with self._calls:
            return method(self, *args, **kwargs)

    return guarded  # type: ignore[return-value]
