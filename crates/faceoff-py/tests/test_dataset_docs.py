"""The programs and commands in `docs/dataset.md` run unchanged."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("pyarrow")

from dataset_recordings import ROOT, game, hold  # noqa: E402

TEXT = (ROOT / "docs" / "dataset.md").read_text()


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)


@pytest.fixture
def beside_recordings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with the recordings that the document uses."""
    (tmp_path / "result").symlink_to(hold())
    (tmp_path / "game").symlink_to(game())
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "minari"))
    return tmp_path


def test_python_blocks_run(beside_recordings: Path) -> None:
    for package in ("pandas", "polars", "minari"):
        pytest.importorskip(package)
    names: dict[str, Any] = {}
    programs = blocks("python")
    assert len(programs) >= 6
    for block in programs:
        exec(compile(block, "docs/dataset.md", "exec"), names)
    assert (beside_recordings / "old" / "7dof-hit" / "dataset.pkl").exists()


def test_shell_commands_run(beside_recordings: Path) -> None:
    pytest.importorskip("minari")
    commands = [line for block in blocks("sh") for line in block.splitlines() if "faceoff.dataset" in line]
    assert len(commands) == 4
    for line in commands:
        program, *arguments = shlex.split(line)
        assert program == "python"
        subprocess.run([sys.executable, *arguments], check=True)
    assert (beside_recordings / "plain" / "steps.parquet").exists()
    assert (beside_recordings / "lerobot-2" / "prepare" / "meta" / "info.json").exists()


def test_sql_queries_run(beside_recordings: Path) -> None:
    duckdb = pytest.importorskip("duckdb")
    with zipfile.ZipFile("result/dataset.zip") as packed:
        packed.extractall(beside_recordings)
    (queries,) = blocks("sql")
    counts = [len(duckdb.sql(query).fetchall()) for query in queries.split(";") if query.strip()]
    # An agent that holds still violates no speed limit.
    assert len(counts) == 2 and counts[0] >= 3 and counts[1] == 0
