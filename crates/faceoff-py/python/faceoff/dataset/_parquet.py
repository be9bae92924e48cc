"""Rewrites the tables of a recording for more Parquet readers."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

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
    folder = Path(out)
    if folder.exists():
        raise ExistsError(f"out: {folder} is there already; name another folder")
    recording.check()
    names = [name for name in recording.manifest["files"] if name.endswith(".parquet")]
    folder.absolute().parent.mkdir(parents=True, exist_ok=True)
    # Written beside it, so that after an error no half of it is left under its name.
    unfinished = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.absolute().parent))
    try:
        for name in names:
            _rewrite(recording._container.table(name), unfinished / name)
        unfinished.chmod(0o755)
        unfinished.rename(folder)
    except BaseException:
        shutil.rmtree(unfinished, ignore_errors=True)
        raise
    return [folder / name for name in names]


def _rewrite(table: pq.ParquetFile, target: Path) -> None:
    schema = _signed(table.schema_arrow)
    with pq.ParquetWriter(target, schema, **OPTIONS) as writer:
        for batch in table.iter_batches(batch_size=BATCH_ROWS):
            writer.write_table(pa.Table.from_batches([batch]).cast(schema))


def _signed(schema: pa.Schema) -> pa.Schema:
    """The schema without unsigned integers, which the first version of the format does not have."""
    fields = [
        field.with_type(pa.int64()) if pa.types.is_unsigned_integer(field.type) else field for field in schema
    ]
    return pa.schema(fields, metadata=schema.metadata)
