"""Reads rows of a Parquet file by row groups."""

from __future__ import annotations

from bisect import bisect_right
from itertools import accumulate
from typing import Any, Sequence

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.parquet as pq

from faceoff.errors import ArgumentTypeError, MissingError

from ._errors import DatasetError

__all__ = ["Rows", "floats", "lists", "seconds", "to_polars"]

Floats = npt.NDArray[np.float64]


class Rows:
    """A table that is read by row ranges; the last row group is cached, so sequential reads unpack each once."""

    def __init__(self, file: pq.ParquetFile, name: str) -> None:
        """Args:
        file: the Parquet file.
        name: its name for error messages.
        """
        self._file = file
        self._name = name
        self.columns: list[str] = file.schema_arrow.names
        counts = (file.metadata.row_group(i).num_rows for i in range(file.num_row_groups))
        self._starts = [0, *accumulate(counts)]
        self._cached: tuple[tuple[int, tuple[str, ...]], pa.Table] | None = None

    def __len__(self) -> int:
        return int(self._starts[-1])

    def read(
        self, start: int = 0, count: int | None = None, columns: Sequence[str] | None = None
    ) -> pa.Table:
        """The rows from ``start`` (included) to ``start + count`` (excluded); without ``count``, to the end.

        Raises:
            ArgumentTypeError: ``columns`` is a text instead of a list.
            DatasetError: a column or rows do not exist, or cannot be read.
        """
        if isinstance(columns, str):
            raise ArgumentTypeError(f"columns: expected a list of names, got the text {columns!r}")
        names = tuple(self.columns if columns is None else columns)
        for name in names:
            if name not in self.columns:
                known = ", ".join(self.columns)
                raise DatasetError(f"{self._name} has no column {name!r}; it has {known}")
        end = len(self) if count is None else start + count
        if end > len(self):
            raise DatasetError(f"{self._name}: expected {end} rows or more, got {len(self)}")
        pieces = []
        group = bisect_right(self._starts, start) - 1
        while group + 1 < len(self._starts) and self._starts[group] < end:
            first = max(start - self._starts[group], 0)
            last = min(end, self._starts[group + 1]) - self._starts[group]
            pieces.append(self._group(group, names).slice(first, last - first))
            group += 1
        if not pieces:
            schema = self._file.schema_arrow
            return pa.schema([schema.field(name) for name in names]).empty_table()
        return pa.concat_tables(pieces)

    def _group(self, group: int, columns: tuple[str, ...]) -> pa.Table:
        key = (group, columns)
        if self._cached is None or self._cached[0] != key:
            try:
                table = self._file.read_row_group(group, columns=list(columns)).select(list(columns))
            except (pa.ArrowException, OSError) as error:
                hint = ""
                if "BYTE_STREAM_SPLIT" in str(error):
                    hint = "; recordings of layout 2 need a newer pyarrow, such as 21"
                raise DatasetError(f"{self._name} cannot be read: {error}{hint}") from error
            self._cached = (key, table)
        return self._cached[1]


def floats(table: pa.Table, names: Sequence[str]) -> Floats:
    """Columns of doubles as one array, shape (rows, columns); NaN for missing values."""
    out = np.empty((table.num_rows, len(names)))
    for index, name in enumerate(names):
        out[:, index] = table.column(name).to_numpy()
    return out


def seconds(table: pa.Table, name: str) -> Floats:
    """A column of nanoseconds in seconds, shape (rows,); NaN for missing values."""
    values = table.column(name).to_numpy()
    return np.asarray(values, dtype=np.float64) / 1e9


def lists(table: pa.Table, name: str, shape: tuple[int, ...], context: str) -> Floats:
    """A column of lists as one array, shape (rows, *shape); NaN for missing lists.

    Raises:
        DatasetError: a list has another length; the message begins with ``context``.
    """
    array = table.column(name).combine_chunks()
    width = int(np.prod(shape))
    lengths = array.value_lengths()
    present = ~np.asarray(lengths.is_null())
    unexpected = [n for n in lengths.drop_null().unique().to_pylist() if n != width]
    if unexpected:
        raise DatasetError(f"{context}: expected {name}s of {width} numbers, got one of {unexpected[0]}")
    out = np.full((len(array), width), np.nan)
    out[present] = np.asarray(array.flatten()).reshape(-1, width)
    return out.reshape(len(array), *shape)


def to_polars(table: pa.Table) -> Any:
    """The table as a polars data frame.

    Raises:
        MissingError: polars is not installed.
    """
    try:
        import polars
    except ImportError as error:
        raise MissingError("polars is needed for this: pip install polars") from error
    return polars.from_arrow(table)
