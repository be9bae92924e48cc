"""Errors of recordings, in addition to :mod:`faceoff.errors`."""

from __future__ import annotations

from faceoff.errors import Error

__all__ = ["DatasetError", "ExistsError"]


class DatasetError(Error):
    """A recording cannot be read or converted; the message names the file and the cause."""


class ExistsError(Error, FileExistsError):
    """The output folder exists already."""
