"""Errors of recordings name the file and the cause; failing commands return 1."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

pytest.importorskip("pyarrow")

import faceoff.dataset as fd  # noqa: E402
from dataset_recordings import FIXTURES, game  # noqa: E402
from faceoff.dataset.__main__ import main  # noqa: E402
from faceoff.errors import Error  # noqa: E402

HOLD = FIXTURES / "dataset-layout-3.zip"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """An unpacked dataset for damaging."""
    with zipfile.ZipFile(HOLD) as packed:
        packed.extractall(tmp_path / "dataset")
    return tmp_path / "dataset"


def flip_bit(path: Path, offset: int) -> None:
    """Flips the lowest bit of the byte at `offset` in a file."""
    data = bytearray(path.read_bytes())
    data[offset] ^= 1
    path.write_bytes(data)


def test_missing_recordings_are_refused(tmp_path: Path) -> None:
    with pytest.raises(fd.DatasetError, match="none: there is no such file or folder"):
        fd.open(tmp_path / "none")
    with pytest.raises(fd.DatasetError, match="expected one of manifest.json, dataset.zip, game.zip"):
        fd.open(tmp_path)


def test_truncated_and_altered_archives_are_refused(tmp_path: Path) -> None:
    copy = tmp_path / "dataset.zip"
    copy.write_bytes(HOLD.read_bytes()[:-1000])
    with pytest.raises(fd.DatasetError, match="dataset.zip: expected a zip archive .* again"):
        fd.open(copy)
    copy.write_bytes(b"")
    with pytest.raises(fd.DatasetError, match="expected a zip archive"):
        fd.open(copy)
    shutil.copy(HOLD, copy)
    flip_bit(copy, 5000)
    with pytest.raises(fd.DatasetError, match=r"dataset.zip: \w+\.\w+ is damaged or altered"):
        fd.open_dataset(copy).check()
    with pytest.raises(fd.DatasetError, match="is damaged or altered"):
        fd.to_2023(fd.open_dataset(copy), tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["steps.parquet", "episodes.parquet"])
def test_missing_and_damaged_tables_are_refused(name: str, folder: Path) -> None:
    path = folder / name
    whole = path.read_bytes()
    for content in (b"", b"PAR1", whole[:-10], b"PAR1" + b"\0" * 100 + b"PAR1"):
        path.write_bytes(content)
        with pytest.raises(fd.DatasetError, match=f"{folder}: {name} is no readable table"):
            fd.open_dataset(folder).table()
        with pytest.raises(fd.DatasetError, match=f"{name}: expected {len(whole)} bytes, got"):
            fd.open_dataset(folder).check()
    path.unlink()
    with pytest.raises(fd.DatasetError, match=f"{name} is missing in the folder"):
        fd.open_dataset(folder).table()


def test_damaged_pages_are_refused(folder: Path) -> None:
    path = folder / "steps.parquet"
    data = bytearray(path.read_bytes())
    data[4 : len(data) // 2] = b"\xff" * (len(data) // 2 - 4)
    path.write_bytes(data)
    with pytest.raises(fd.DatasetError, match="steps.parquet cannot be read"):
        fd.open_dataset(folder).table()


def test_invalid_manifests_are_refused(folder: Path) -> None:
    path = folder / "manifest.json"
    manifest = json.loads(path.read_text())
    for content, message in (
        ("{", "manifest.json is not JSON"),
        ("[]", "manifest.json: expected a JSON object, got a list"),
        ("{}", "layout: expected one of faceoff-dataset/4, .*, got None"),
        (
            json.dumps({**manifest, "schema": "faceoff-dataset/9"}),
            "layout: expected one of .*, got 'faceoff-dataset/9'",
        ),
        (json.dumps({**manifest, "episodes": 3}), "expected 'episodes' to be a dict, got 3"),
        (json.dumps({**manifest, "schema": "faceoff-game/1"}), "expected 'agents' to be a list"),
    ):
        path.write_text(content)
        with pytest.raises(fd.DatasetError, match=message):
            fd.open(folder)


def test_tables_of_different_datasets_are_refused(folder: Path) -> None:
    other = folder.parent / "other"
    with zipfile.ZipFile(FIXTURES / "dataset-layout-2.zip") as packed:
        packed.extractall(other)
    shutil.copy(other / "steps.parquet", folder / "steps.parquet")
    with pytest.raises(fd.DatasetError, match="expected 1149 rows as episodes.parquet has it, got 548"):
        fd.open_dataset(folder).table()
    shutil.copy(other / "steps.parquet", folder / "episodes.parquet")
    with pytest.raises(fd.DatasetError, match="episodes.parquet has no column 'seed'"):
        fd.open_dataset(folder).episodes()


def test_invalid_arguments_are_refused() -> None:
    dataset = fd.open_dataset(HOLD)
    for index in (-1, 2):
        with pytest.raises(ValueError, match=f"expected an episode of hit from 0 to 1, got {index}"):
            dataset.episode("hit", index)
    with pytest.raises(ValueError, match="task: expected one of hit, defend, got 'prepare'"):
        dataset.episodes("prepare")
    with pytest.raises(ValueError, match="table: expected 'steps' or 'episodes', got 'step'"):
        dataset.table("step")  # type: ignore[arg-type]
    with pytest.raises(fd.DatasetError, match="steps.parquet has no column 'speed'; it has task, "):
        dataset.episode("hit", 0).table(["speed"])
    with pytest.raises(TypeError, match="columns: expected a list of names, got the text 'puck_x'"):
        dataset.episode("hit", 0).table("puck_x")
    with pytest.raises(TypeError, match="index: expected a whole number, got '0'"):
        dataset.episode("hit", "0")  # type: ignore[arg-type]


def test_errors_derive_from_faceoff_error(tmp_path: Path) -> None:
    for call in (
        lambda: fd.open(tmp_path),
        lambda: fd.open_dataset(HOLD).episodes("prepare"),
        lambda: fd.open_dataset(HOLD).table("step"),  # type: ignore[arg-type]
        lambda: fd.to_lerobot(fd.open_dataset(HOLD), tmp_path, "hit"),
    ):
        with pytest.raises(Error):
            call()


def command(*arguments: object) -> tuple[int, str, str]:
    """Runs `python -m faceoff.dataset`: its exit status, standard output and standard error."""
    done = subprocess.run(
        [sys.executable, "-m", "faceoff.dataset", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr


def test_commands_summarise_and_export(tmp_path: Path) -> None:
    code, out, _ = command("info", HOLD, "--json")
    summary = json.loads(out)
    assert code == 0 and summary["agent"] == "hold" and summary["tasks"]["hit"]["episodes"] == 2
    code, out, _ = command("export", HOLD, "--layout", "2023", "--out", tmp_path / "old")
    assert code == 0 and out.splitlines() == [
        str(tmp_path / "old" / "7dof-hit"),
        str(tmp_path / "old" / "7dof-defend"),
    ]
    code, out, _ = command("export", HOLD, "--layout", "lerobot", "--out", tmp_path / "new")
    assert code == 0 and (tmp_path / "new" / "defend" / "meta" / "info.json").exists()


def test_failing_commands_print_one_line_and_return_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = str(tmp_path / "out")
    for arguments, message in (
        (["info", "none"], "error: none: there is no such file or folder"),
        (["export", str(HOLD), "--layout", "2023"], "--out: expected a folder for the layout 2023"),
        (["export", str(HOLD), "--layout", "minari"], "--id: expected an id such as faceoff/hit/"),
        (["export", str(game()), "--layout", "2023", "--out", out], "got a game"),
        (
            ["export", str(HOLD), "--layout", "lerobot", "--out", out, "--task", "prepare"],
            "task: expected one of hit, defend, got 'prepare'",
        ),
    ):
        assert main(arguments) == 1
        output = capsys.readouterr()
        assert output.out == "" and output.err.startswith("error: ") and message in output.err
        assert len(output.err.splitlines()) == 1
    assert main(["info", str(game())]) == 0
    assert "layout: faceoff-game/1" in capsys.readouterr().out


def test_command_exports_a_minari_dataset(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("minari")
    arguments = ["--layout", "minari", "--id", "faceoff/hit/hold-v0", "--out", str(tmp_path)]
    assert main(["export", str(HOLD), *arguments]) == 0
    assert capsys.readouterr().out == "faceoff/hit/hold-v0: 2 episodes, 1000 steps\n"
    # Minari refuses an id that exists.
    assert main(["export", str(HOLD), *arguments]) == 1
