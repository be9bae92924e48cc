"""Recordings and exports are read by old Parquet readers and an old NumPy.

They are installed once, in a separate environment: `FACEOFF_OLD_READERS` names its folder
(default: `target/python/old-readers`).
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from functools import cache
from pathlib import Path

import pytest

pytest.importorskip("pyarrow")

import faceoff.dataset as fd  # noqa: E402
from dataset_recordings import FIXTURES, PROGRAM, ROOT, game, hold, odd  # noqa: E402

HERE = Path(__file__).parent
REQUIREMENTS = HERE / "requirements-old-readers.txt"

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


@cache
def python() -> Path:
    """The interpreter of the environment with the old readers."""
    folder = Path(os.environ.get("FACEOFF_OLD_READERS", ROOT / "target" / "python" / "old-readers"))
    base = sys.executable if sys.version_info[:2] == (3, 11) else shutil.which("python3.11")
    if base is None:
        pytest.skip("pyarrow 12 has no wheel for this Python, and there is no python3.11 here")
    subprocess.run(
        [ROOT / "tests" / "python-environment.sh", folder, REQUIREMENTS], env={**os.environ, "PYTHON": base}, check=True
    )
    return folder / "bin" / "python"


def run(*arguments: object) -> str:
    environment = {
        **os.environ,
        "PYTHONPATH": str(ROOT / "crates" / "faceoff-py" / "python"),
        "FACEOFF_BIN": str(PROGRAM),
    }
    done = subprocess.run(
        [python(), *map(str, arguments)],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


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
