"""The error of this package."""

from __future__ import annotations

__all__ = ["DatasetError"]


class DatasetError(Exception):
    """A recording cannot be read or converted; the message names the file and the cause."""
