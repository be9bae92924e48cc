"""`python -m faceoff.challenge_2023` makes bundles from folders of 2023, and refuses what cannot be one."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest
from agents_2023 import TEAM, convert, program

import faceoff
from faceoff.challenge_2023 import make_bundle
from faceoff.challenge_2023._config import read_config

HOLD = "class A:\n    reset = lambda self: None\n    draw_action = lambda self, o: [o[6:13], [0] * 7]\n"

BUILDER = HOLD + "def build_agent(env_info, **kwargs):\n    return A()\n"


def team_with(folder: Path, **files: str) -> Path:
    """A team's package with `agent_builder` and other modules of these texts."""
    folder.mkdir(parents=True)
    for name, text in files.items():
        (folder / name.replace("__", ".")).write_text(text)
    return folder


def test_bundle_contains_the_teams_files_unchanged(tmp_path: Path) -> None:
    bundle = tmp_path / "follower"
    done = convert(TEAM, bundle)
    assert done.returncode == 0 and f"faceoff eval {bundle}" in done.stdout, done.stderr
    for path in (TEAM / "air_hockey_agent").glob("*.*"):
        assert (bundle / "team" / "air_hockey_agent" / path.name).read_bytes() == path.read_bytes()
    assert (bundle / "agent.toml").read_text().splitlines() == [
        'name = "follower"',
        'command = ["python3", "play_2023.py"]',
        'runtime = "python3-ml"',
        "interpolation = 3",
    ]
    assert not list(bundle.rglob("*.so")) + list(bundle.rglob("__pycache__"))
    assert not [path for path in bundle.parent.iterdir() if path != bundle]


def test_package_alone_is_converted_like_the_folder_above(tmp_path: Path) -> None:
    bundle = tmp_path / "follower"
    make_bundle(TEAM, bundle)
    make_bundle(TEAM / "air_hockey_agent", tmp_path / "alone", name="ours", runtime="image")
    team = {path.relative_to(bundle) for path in (bundle / "team").rglob("*.py")}
    assert {path.relative_to(tmp_path / "alone") for path in (tmp_path / "alone" / "team").rglob("*.py")} == team
    assert (tmp_path / "alone" / "agent.toml").read_text().startswith('name = "ours"\n')
    assert 'runtime = "image"' in (tmp_path / "alone" / "agent.toml").read_text()


def test_package_of_2023_and_repository_are_left_out(tmp_path: Path) -> None:
    fork = tmp_path / "fork"
    # Another test may have imported the team from its place.
    shutil.copytree(TEAM, fork, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("air_hockey_challenge/framework", ".git", "air_hockey_agent/__pycache__", "baseline"):
        (fork / name).mkdir(parents=True)
        (fork / name / "file.py").touch()
    (fork / "air_hockey_agent" / "link.py").symlink_to("motion.py")
    make_bundle(fork, tmp_path / "bundle")
    assert {path.name for path in (tmp_path / "bundle" / "team").iterdir()} == {"air_hockey_agent", "baseline"}
    assert os.readlink(tmp_path / "bundle" / "team" / "air_hockey_agent" / "link.py") == "motion.py"


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"agent": BUILDER}, "expected agent_builder.py or air_hockey_agent/agent_builder.py in"),
        ({"agent_builder__py": HOLD}, "expected a function build_agent(env_info, **kwargs), got a file without it"),
        ({"agent_builder__py": "def build_agent(:"}, "expected a Python file, got invalid syntax"),
        (
            {"agent_config__yml": "interpolation_order: 6\n"},
            "interpolation_order: expected one of 1, 2, 3, 4, 5, -1, None, got 6",
        ),
        ({"agent_config__yml": "interpolation_order: true\n"}, "interpolation_order: expected one of"),
        ({"agent_config__yml": "start: 2023-10-06\n"}, "agent_config.yml"),
        ({"agent_config__yml": "- 3\n"}, "agent_config.yml: "),
        ({"agent_config__yml": "\0"}, "agent_config.yml: "),
    ],
)
def test_folders_that_are_no_agents_are_refused(files: dict[str, str], message: str, tmp_path: Path) -> None:
    folder = team_with(tmp_path / "team", **({"agent_builder__py": BUILDER} if "agent" not in files else {}) | files)
    done = convert(folder, tmp_path / "bundle")
    assert done.returncode == 1 and done.stdout == ""
    assert done.stderr.startswith("error: ") and message in done.stderr and done.stderr.count("\n") == 1, done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["team"]


def test_folders_that_cannot_be_copied_are_refused(tmp_path: Path) -> None:
    folder = team_with(tmp_path / "team", agent_builder__py=BUILDER)
    (tmp_path / "secret").touch()
    cases: dict[str, Any] = {
        "outwards": lambda path: path.symlink_to("../secret"),
        "absolute": lambda path: path.symlink_to(folder / "agent_builder.py"),
        "pipe": os.mkfifo,
    }
    for name, make in cases.items():
        make(folder / name)
        with pytest.raises(faceoff.ArgumentError, match=f"folder: expected .*{name}'.*; "):
            make_bundle(folder, tmp_path / "bundle")
        (folder / name).unlink()
    assert {path.name for path in tmp_path.iterdir()} == {"team", "secret"}


def test_arguments_of_make_bundle_are_checked(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for arguments, options, message in [
        ((tmp_path / "none", tmp_path / "b"), {}, "folder: expected a team's folder of 2023, got .*no folder"),
        ((TEAM, tmp_path / "file"), {}, "bundle: expected a new folder, got .*exists; choose another name"),
        ((TEAM, tmp_path), {}, "bundle: expected a new folder"),
        ((TEAM, TEAM / "bundle"), {}, "bundle: expected a folder outside"),
        ((TEAM, tmp_path / "file" / "bundle"), {}, "bundle: expected a folder that can be created"),
        ((3, tmp_path / "b"), {}, "folder: expected the path of a folder, got 3"),
        ((TEAM, ""), {}, "bundle: expected the path of a folder, got ''"),
        ((TEAM, tmp_path / "b"), {"name": "two\nlines"}, "name: expected 1 to 60 printable characters"),
        ((TEAM, tmp_path / "b"), {"name": 3}, "name: expected a text, got 3"),
        ((TEAM, tmp_path / "b"), {"runtime": ""}, "runtime: expected 1 to 40"),
    ]:
        with pytest.raises(faceoff.Error, match=message):
            make_bundle(*arguments, **options)  # type: ignore[arg-type]
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_missing_packages_are_named_with_advice(tmp_path: Path) -> None:
    for statement, error, advice in [
        ("import torch", "import of torch: expected a module", "bring it in a container image"),
        ("from mushroom_rl.core import Agent", "import of mushroom_rl", "compute it with NumPy"),
        ("import air_hockey_challenge.environments", "air_hockey_challenge.environments: expected", "faceoff.gym"),
        ("import air_hockey_challenge.utils.plots", "import of air_hockey_challenge.utils.plots", "from-2023.md"),
        (
            "from air_hockey_challenge.utils import plot",
            "expected that it succeeds, got: cannot import name",
            "from-2023.md",
        ),
        ("from baseline.baseline_agent import X", "import of baseline", "convert the folder above"),
    ]:
        place = tmp_path / statement.replace(" ", "-")
        make_bundle(team_with(place / "team", agent_builder__py=f"{statement}\n{BUILDER}"), place / "bundle")
        done = program("eval", place / "bundle", "--task", "defend", "--episodes", 1, "--out", place / "out")
        text = done.stderr + done.stdout
        assert done.returncode != 0 and error in text and advice in text, text


def test_configuration_is_read_as_by_pyyaml(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "yaml", None)
    path = tmp_path / "agent_config.yml"
    path.write_text(
        "--- \n# comment\n\ninterpolation_order: -1\nnothing: null\nalso:\nyes_: yes\nrate: 1.5e-3\nword: 1e-3x # no\n"
        "path: models/best model.npz\nquoted: 'a: #b'\nenvs: [ \"7dof-hit\", 3, false ]\nempty: []\n".replace(
            "1e-3x", "fast"
        )
    )
    assert read_config(path) == {
        "interpolation_order": -1, "nothing": None, "also": None, "yes_": True, "rate": 0.0015, "word": "fast",
        "path": "models/best model.npz", "quoted": "a: #b", "envs": ["7dof-hit", 3, False], "empty": [],
    }  # fmt: skip
    assert read_config(tmp_path / "none.yml") == {}
    for text in ("a: {b: 1}", "a:\n  b: 1", "- 1", "a: 2023-10-06", "a: 0x1f", "a: [[1]]", "a: 1e-3", "a: &x 1", "a"):
        path.write_text(text)
        with pytest.raises(faceoff.ArgumentError, match="agent_config.yml: line [12]: expected a key .*install PyYAML"):
            read_config(path)
    path.write_bytes(b"\xff")
    with pytest.raises(faceoff.ArgumentError, match="expected a YAML file in UTF-8"):
        read_config(path)


def test_configuration_without_json_values_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    yaml = type(sys)("yaml")
    yaml.YAMLError = ValueError  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "yaml", yaml)
    (tmp_path / "a.yml").touch()
    results: list[tuple[Any, str]] = [
        ([1], r"expected keys with values, got \[1\]"),
        ({1: 2}, "expected keys with values"),
        ({"a": object()}, "expected numbers, words, lists and keys with values, got .*; compute other values"),
        ({"a": float("nan")}, "expected numbers, words"),
    ]
    for value, message in results:
        yaml.safe_load = lambda text, value=value: value  # type: ignore[attr-defined]
        with pytest.raises(faceoff.Error, match=message):
            read_config(tmp_path / "a.yml")
    yaml.safe_load = lambda text: {"nested": {"a": [1]}}  # type: ignore[attr-defined]
    assert read_config(tmp_path / "a.yml") == {"nested": {"a": [1]}}
    yaml.safe_load = lambda text: float("x")  # type: ignore[attr-defined]
    with pytest.raises(faceoff.ArgumentError, match="a.yml: expected YAML, got could not convert"):
        read_config(tmp_path / "a.yml")
