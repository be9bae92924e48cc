"""Recordings and exports are read by old Parquet readers, by readers of other origin, and by an old NumPy.

Readers are installed once, in an environment for each file of requirements beside this one, in the folder that
`FACEOFF_READERS` names (default: `target/python-readers`).
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import zipfile
from functools import cache
from pathlib import Path

import pytest

pq = pytest.importorskip("pyarrow.parquet")

import faceoff
import faceoff.dataset as fd  # noqa: E402
from dataset_recordings import FIXTURES, PROGRAM, ROOT, game, hold, odd  # noqa: E402

HERE = Path(__file__).parent

# Control steps in the fixture dataset-layout-3.zip.
LAYOUT_3_STEPS = 1149

# Reads every table of the archives with pyarrow and with DuckDB, and compares all values.
READ = """
import sys, tempfile, zipfile
import duckdb, numpy, pyarrow, pyarrow.parquet
assert (pyarrow.__version__, numpy.__version__) == ("12.0.1", "1.24.4")
tables = rows = 0
for archive in sys.argv[1:]:
    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(archive) as packed:
        for name in packed.namelist():
            if not name.endswith(".parquet"):
                continue
            path = packed.extract(name, folder)
            read = pyarrow.parquet.read_table(path)
            found = duckdb.sql(f"SELECT * FROM '{path}'").fetchall()
            assert [tuple(row.values()) for row in read.to_pylist()] == found, (archive, name)
            tables, rows = tables + 1, rows + len(found)
print(tables, rows)
"""

# Loads the last transition and the times of an export in the layout of 2023.
READ_EXPORT = """
import sys, numpy
steps = numpy.load(sys.argv[1] + "/7dof-hit/dataset.pkl", allow_pickle=True)
state, action, reward, after, absorbing, last = steps[-1]
assert state.shape == after.shape == (23,) and action.shape == (2, 7) and last
assert state.dtype == action.dtype == numpy.float64 and reward == 0.0
times = numpy.load(sys.argv[1] + "/7dof-hit/computation_time.npy")
assert times.shape == (len(steps),)
print(len(steps))
"""


# Reads a column of numbers, one of texts and the actions of a table; prints them with all bits.
READ_COLUMNS = """
import json, sys
reader, path = sys.argv[1:]
if reader == "fastparquet":
    import fastparquet
    frame = fastparquet.ParquetFile(path).to_pandas()
    columns = {name: frame[name].tolist() for name in ("puck_x", "task", "step", "action")}
else:
    import polars
    frame = polars.read_parquet(path)
    columns = {name: frame[name].to_list() for name in ("puck_x", "task", "step", "action")}
print(json.dumps(columns, default=float))
"""


@cache
def python(readers: str) -> Path:
    """The interpreter of the environment with these readers."""
    folder = Path(os.environ.get("FACEOFF_READERS", ROOT / "target" / "python-readers")) / readers
    base = sys.executable if sys.version_info[:2] == (3, 11) else shutil.which("python3.11")
    if base is None:
        pytest.skip("some of these readers have no wheel for this Python, and there is no python3.11 here")
    subprocess.run(
        [ROOT / "tests" / "python-environment.sh", folder, HERE / f"requirements-{readers}-readers.txt"],
        env={**os.environ, "PYTHON": base},
        check=True,
    )
    return folder / "bin" / "python"


def run(*arguments: object, readers: str = "old") -> str:
    environment = {
        **os.environ,
        "PYTHONPATH": str(ROOT / "crates" / "faceoff-py" / "python"),
        "FACEOFF_BIN": str(PROGRAM),
    }
    done = subprocess.run(
        [python(readers), *map(str, arguments)],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def expected_columns() -> dict[str, list[object]]:
    table = fd.open_dataset(hold()).table(columns=["puck_x", "task", "step", "action"])
    return {name: table[name].to_pylist() for name in table.column_names}


def test_polars_1_0_reads_recordings(tmp_path: Path) -> None:
    with zipfile.ZipFile(hold() / "dataset.zip") as packed:
        path = packed.extract("steps.parquet", tmp_path)
    assert json.loads(run("-c", READ_COLUMNS, "polars", path, readers="polars")) == expected_columns()


@pytest.mark.parametrize("reader", ["fastparquet", "polars"])
def test_other_readers_read_the_export_of_plain_parquet(reader: str, tmp_path: Path) -> None:
    """Polars here is 0.18, of 2023."""
    fd.to_parquet(fd.open_dataset(hold()), tmp_path / "plain")
    path = tmp_path / "plain" / "steps.parquet"
    assert json.loads(run("-c", READ_COLUMNS, reader, path, readers="other")) == expected_columns()


def test_plain_parquet_has_all_tables_with_the_same_values(tmp_path: Path) -> None:
    for name, recording in {"dataset": fd.open(odd()), "game": fd.open(game())}.items():
        files = fd.to_parquet(recording, tmp_path / name)
        assert {file.name for file in files} == {n for n in recording.manifest["files"] if n.endswith(".parquet")}
        for file in files:
            got, expected = pq.ParquetFile(file), recording._container.table(file.name)
            chunk = got.metadata.row_group(0).column(3)
            assert (chunk.compression, set(chunk.encodings) - {"RLE"}) == ("SNAPPY", {"PLAIN"})
            assert got.read().to_pylist() == expected.read().to_pylist()
            assert got.metadata.metadata[b"faceoff.schema"] == expected.metadata.metadata[b"faceoff.schema"]


def test_plain_parquet_leaves_nothing_after_an_error(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    with pytest.raises(fd.ExistsError, match="out: .*there is there already; name another folder"):
        fd.to_parquet(fd.open(hold()), tmp_path / "there")
    with pytest.raises(faceoff.ArgumentTypeError, match="recording: expected what faceoff.dataset.open returns, got 'x'"):
        fd.to_parquet("x", tmp_path / "new")  # type: ignore[arg-type]
    with pytest.raises(faceoff.ArgumentTypeError, match="out: expected a path, got 5"):
        fd.to_parquet(fd.open(hold()), 5)  # type: ignore[arg-type]
    (tmp_path / "there" / "file").touch()
    with pytest.raises(faceoff.ArgumentError, match="out: expected a folder that can be created"):
        fd.to_parquet(fd.open(hold()), tmp_path / "there" / "file" / "new")
    damaged = tmp_path / "damaged"
    with zipfile.ZipFile(hold() / "dataset.zip") as packed:
        packed.extractall(damaged)
    (damaged / "steps.parquet").write_bytes(b"PAR1" + bytes(100) + b"PAR1")
    with pytest.raises(fd.DatasetError):
        fd.to_parquet(fd.open(damaged), tmp_path / "new")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["damaged", "there"]


def test_pyarrow_12_and_duckdb_read_recordings() -> None:
    archives = [hold() / "dataset.zip", odd() / "dataset.zip", game() / "game.zip"]
    archives += [game() / "side-1.zip", FIXTURES / "dataset-layout-3.zip"]
    tables, rows = map(int, run("-c", READ, *archives).split())
    # Of two datasets, a game, one side of it, and the dataset of layout 3.
    assert tables == 2 + 2 + 6 + 4 + 2
    assert rows > LAYOUT_3_STEPS + len(fd.open_dataset(hold()).table())


def test_current_duckdb_reads_recordings(tmp_path: Path) -> None:
    duckdb = pytest.importorskip("duckdb")
    with zipfile.ZipFile(hold() / "dataset.zip") as packed:
        path = packed.extract("steps.parquet", tmp_path)
    found = duckdb.sql(f"SELECT * FROM '{path}'").fetchall()
    rows = fd.open_dataset(hold()).table().to_pylist()
    assert found == [tuple(row.values()) for row in rows]


def test_numpy_1_24_reads_the_layout_of_2023(tmp_path: Path) -> None:
    dataset = fd.open_dataset(hold())
    fd.to_2023(dataset, tmp_path)
    steps = sum(episode.steps for episode in dataset.episodes("hit"))
    assert int(run("-c", READ_EXPORT, tmp_path)) == steps


def test_package_works_with_old_readers() -> None:
    program = """
import sys, faceoff.dataset as fd
from faceoff.dataset.__main__ import main
dataset = fd.open_dataset(sys.argv[1])
for episode in dataset:
    arrays = episode.to_numpy()
    assert len(arrays.observations) == episode.steps + 1
    assert len(episode.to_pandas()) == episode.steps
assert main(["export", sys.argv[1], "--layout", "2023", "--out", sys.argv[2] + "/old"]) == 0
assert main(["export", sys.argv[1], "--layout", "lerobot", "--out", sys.argv[2] + "/new"]) == 0
try:
    fd.open_dataset(sys.argv[3]).table()
except fd.DatasetError as error:
    assert "recordings of layout 2 need a newer pyarrow" in str(error)
else:
    raise AssertionError("pyarrow 12 has read layout 2")
"""
    folder = hold().parent / "beside"
    run("-c", program, hold(), folder, FIXTURES / "dataset-layout-2.zip")
