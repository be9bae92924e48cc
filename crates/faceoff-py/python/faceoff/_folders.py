"""Folders that this package writes: bundles, exports."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from faceoff.errors import ArgumentError

#: The folder of this package.
PACKAGE = Path(__file__).parent


@contextmanager
def new_folder(argument: str, folder: Path) -> Iterator[Path]:
    """A temporary folder that becomes ``folder`` at the end, so that no half of it remains after an error.

    ``argument`` is the name of the caller's argument, for the error message. Missing parents are made.
    """
    place = folder.absolute()
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        unfinished = Path(tempfile.mkdtemp(prefix=f".{place.name[:100]}-", dir=place.parent))
    except (OSError, ValueError) as error:
        raise ArgumentError(f"{argument}: expected a folder that can be created, got {folder}: {error}") from error
    try:
        yield unfinished
        unfinished.chmod(0o755)
        unfinished.rename(place)
    except BaseException:
        shutil.rmtree(unfinished, ignore_errors=True)
        raise


def copy_parts(parts: Iterable[str], bundle: Path) -> None:
    """Copies files and folders of this package into a bundle, where agents import them as ``faceoff``."""
    target = bundle / "faceoff"
    target.mkdir()
    for part in parts:
        source, copy = PACKAGE / part, target / part
        if source.is_dir():
            shutil.copytree(source, copy, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copyfile(source, copy)
