"""The files of a recording: a folder, or an archive that is read in place."""

from __future__ import annotations

import json
import os
import struct
import zipfile
import zlib
from pathlib import Path
from typing import Any, Mapping, Sequence

import pyarrow as pa
import pyarrow.parquet as pq

from ._errors import DatasetError

__all__ = ["Container", "find"]

MANIFEST = "manifest.json"
# Archives in the output folders of `faceoff eval` and `faceoff play`.
ARCHIVES = ("dataset.zip", "game.zip")
# Header of a file in a zip: the fixed part ends with the lengths of the name and extra field that follow.
LOCAL_HEADER_BYTES = 30
LOCAL_HEADER_LENGTHS = struct.Struct("<HH")
LOCAL_HEADER_LENGTHS_OFFSET = 26
# Files are hashed in pieces of this size.
CHECK_BYTES = 1 << 24


def find(path: str | os.PathLike[str]) -> Container:
    """Opens an archive, a folder with its unpacked content, or a folder that contains an archive.

    Raises:
        DatasetError: there is no recording, or it cannot be read.
    """
    location = Path(path)
    if not location.exists():
        raise DatasetError(f"{location}: there is no such file or folder")
    if not location.is_dir():
        return Container(location)
    if (location / MANIFEST).exists():
        return Container(location)
    for name in ARCHIVES:
        if (location / name).exists():
            return Container(location / name)
    expected = ", ".join((MANIFEST, *ARCHIVES))
    raise DatasetError(f"{location}: expected one of {expected} in this folder, found none")


class Container:
    """The files of one recording.

    Tables are mapped into memory; archives store them uncompressed.
    """

    def __init__(self, path: Path) -> None:
        """Opens a folder or an archive.

        Raises:
            DatasetError: the archive cannot be read.
        """
        self.path = path
        self._zip: zipfile.ZipFile | None = None
        if not path.is_dir():
            try:
                self._zip = zipfile.ZipFile(path)
            except (zipfile.BadZipFile, OSError, ValueError) as error:
                raise DatasetError(
                    f"{path}: expected a zip archive of a recording: {error}; download it again"
                ) from error

    def names(self) -> list[str]:
        """The files' names, sorted."""
        if self._zip is not None:
            return sorted(self._zip.namelist())
        return sorted(entry.name for entry in self.path.iterdir() if entry.is_file())

    def bytes(self, name: str) -> bytes:
        """The content of a file.

        Raises:
            DatasetError: it is missing or damaged.
        """
        try:
            if self._zip is not None:
                return self._zip.read(name)
            return (self.path / name).read_bytes()
        except KeyError as error:
            raise DatasetError(f"{self.path}: {name} is missing in the archive") from error
        except FileNotFoundError as error:
            raise DatasetError(f"{self.path}: {name} is missing in the folder") from error
        except (OSError, ValueError, zipfile.BadZipFile, zlib.error, NotImplementedError) as error:
            raise DatasetError(f"{self.path}: {name} is damaged: {error}") from error

    def json(self, name: str) -> dict[str, Any]:
        """A file that holds one JSON object.

        Raises:
            DatasetError: it is missing or not a JSON object.
        """
        try:
            value = json.loads(self.bytes(name))
        except ValueError as error:
            raise DatasetError(f"{self.path}: {name} is not JSON: {error}") from error
        if not isinstance(value, dict):
            kind = type(value).__name__
            raise DatasetError(f"{self.path}: {name}: expected a JSON object, got a {kind}")
        return value

    def check_manifest(
        self, manifest: Mapping[str, Any], layouts: Sequence[str], **fields: type
    ) -> None:
        """Checks a manifest's layout, and that its fields have these types.

        Raises:
            DatasetError: the layout is not among `layouts`, or a field is missing or of another type.
        """
        if manifest.get("schema") not in layouts:
            known = ", ".join(layouts)
            raise DatasetError(
                f"{self.path}: layout: expected one of {known}, got {manifest.get('schema')!r}"
            )
        for key, kind in fields.items():
            if not isinstance(manifest.get(key), kind):
                raise DatasetError(
                    f"{self.path}: {MANIFEST}: expected {key!r} to be a {kind.__name__}, "
                    f"got {manifest.get(key)!r}"
                )

    def table(self, name: str) -> pq.ParquetFile:
        """A Parquet file; only its footer is read here.

        Raises:
            DatasetError: it is missing or not a Parquet file.
        """
        buffer = self._buffer(name)
        try:
            return pq.ParquetFile(pa.BufferReader(buffer))
        except (pa.ArrowException, OSError) as error:
            raise DatasetError(f"{self.path}: {name} is no readable table: {error}") from error

    def check(self, files: Mapping[str, Mapping[str, Any]]) -> None:
        """Compares files with their expected sizes and, where possible, hashes.

        Args:
            files: ``bytes`` and ``blake3`` per file, as in a manifest. Hashes are compared if the package
                ``blake3`` is installed; an archive's own checksums always are.

        Raises:
            DatasetError: a file is missing, damaged or altered.
        """
        hasher = _hasher()
        for name, expected in files.items():
            buffer = memoryview(self._buffer(name))
            if len(buffer) != expected["bytes"]:
                raise DatasetError(
                    f"{self.path}: {name}: expected {expected['bytes']} bytes, got {len(buffer)}; "
                    "download it again"
                )
            crc, hash_ = 0, hasher() if hasher is not None else None
            for start in range(0, len(buffer), CHECK_BYTES):
                piece = buffer[start : start + CHECK_BYTES]
                crc = zlib.crc32(piece, crc)
                if hash_ is not None:
                    hash_.update(piece)
            is_intact = self._zip is None or crc == self._zip.getinfo(name).CRC
            if not is_intact or (hash_ is not None and hash_.hexdigest() != expected["blake3"]):
                raise DatasetError(
                    f"{self.path}: {name} is damaged or altered: its hash is not the manifest's; "
                    "download it again"
                )

    def _buffer(self, name: str) -> pa.Buffer:
        if self._zip is None:
            path = self.path / name
            if not path.is_file():
                raise DatasetError(f"{self.path}: {name} is missing in the folder")
            if path.stat().st_size == 0:
                return pa.py_buffer(b"")
            return pa.memory_map(str(path)).read_buffer()
        try:
            entry = self._zip.getinfo(name)
        except KeyError as error:
            raise DatasetError(f"{self.path}: {name} is missing in the archive") from error
        if entry.compress_type != zipfile.ZIP_STORED:
            # A repacked archive may be compressed.
            return pa.py_buffer(self.bytes(name))
        whole = pa.memory_map(str(self.path)).read_buffer()
        header = memoryview(whole)[entry.header_offset :][:LOCAL_HEADER_BYTES]
        if len(header) == LOCAL_HEADER_BYTES:
            lengths = LOCAL_HEADER_LENGTHS.unpack_from(header, LOCAL_HEADER_LENGTHS_OFFSET)
            start = entry.header_offset + LOCAL_HEADER_BYTES + sum(lengths)
            if start + entry.file_size <= whole.size:
                return whole.slice(start, entry.file_size)
        raise DatasetError(f"{self.path}: {name} ends after the archive's end; download it again")


def _hasher() -> Any:
    """The class `blake3.blake3`, or None if that package is not installed."""
    try:
        from blake3 import blake3  # type: ignore[import-not-found,unused-ignore]
    except ImportError:
        return None
    return blake3
