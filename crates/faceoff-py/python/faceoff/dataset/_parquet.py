"""Rewrites the tables of a recording for more Parquet readers."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from faceoff._folders import new_folder
from faceoff.errors import ArgumentTypeError

from ._dataset import Dataset
from ._errors import ExistsError
from ._game import Game

__all__ = ["to_parquet"]

#: What every reader knows: the first version of the format, plain values, the most common compression.
OPTIONS: dict[str, Any] = {
    "version": "1.0",
    "data_page_version": "1.0",
    "compression": "snappy",
    "use_dictionary": False,
}
#: The entry with the schema of Arrow, which the writer makes itself.
ARROW_SCHEMA = b"ARROW:schema"
#: Rows that are in memory at once.
BATCH_ROWS = 65_536


def to_parquet(recording: Dataset | Game, out: str | os.PathLike[str]) -> list[Path]:
    """Writes every table with the same names, columns and values, in encodings that old and simple readers know.

    Values are plain, pages are compressed by Snappy, and unsigned integers become int64. The files are larger than
    those of the recording (docs/dataset.md).

    Args:
        recording: its files are compared with their hashes first.
        out: a folder that does not exist yet.

    Returns:
        The files.

    Raises:
        DatasetError: the recording is damaged.
        ExistsError: `out` exists already.
    """
    if not isinstance(recording, (Dataset, Game)):
        raise ArgumentTypeError(f"recording: expected what faceoff.dataset.open returns, got {recording!r:.80}")
    try:
        folder = Path(out)
    except TypeError:
        raise ArgumentTypeError(f"out: expected a path, got {out!r:.80}") from None
    if os.path.lexists(folder):
        raise ExistsError(f"out: {folder} is there already; name another folder")
    recording.check()
    names = [name for name in recording.manifest["files"] if name.endswith(".parquet")]
    with new_folder("out", folder) as unfinished:
        for name in names:
            _rewrite(recording._container.table(name), unfinished / name)
    return [folder / name for name in names]


def _rewrite(table: pq.ParquetFile, target: Path) -> None:
    # The layout's name is in the metadata of the file, not of the schema.
    metadata = {key: value for key, value in (table.metadata.metadata or {}).items() if key != ARROW_SCHEMA}
    schema = _signed(table.schema_arrow).with_metadata(metadata)
    with pq.ParquetWriter(target, schema, **OPTIONS) as writer:
        for batch in table.iter_batches(batch_size=BATCH_ROWS):
            writer.write_table(pa.Table.from_batches([batch]).cast(schema))


def _signed(schema: pa.Schema) -> pa.Schema:
    """The schema without unsigned integers, which the first version of the format does not have."""
    fields = [
        field.with_type(pa.int64()) if pa.types.is_unsigned_integer(field.type) else field for field in schema
    ]
    return pa.schema(fields)
