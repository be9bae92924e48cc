"""``python -m faceoff.dataset``: summarises a recording, or exports it in another layout."""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from typing import Any, Sequence

from faceoff.errors import ArgumentError, Error

from . import Dataset, Game, open, open_dataset, to_2023, to_lerobot, to_minari, to_parquet


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command.

    Returns:
        The exit code: 0, or 1 after an error, with one line on standard error.
    """
    options = _parser().parse_args(arguments)
    try:
        options.run(options)
    except (Error, ValueError, ImportError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m faceoff.dataset",
        description="Summarises recordings of evaluations and games, and exports datasets in other layouts.",
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    recording = "dataset.zip or game.zip, a folder with its content, or the output folder of eval or play"

    info = commands.add_parser("info", help="summarise a recording")
    info.add_argument("recording", help=recording)
    info.add_argument("--json", action="store_true", help="print it as a JSON object")
    info.set_defaults(run=_info)

    export = commands.add_parser("export", help="write a recording in another layout")
    export.add_argument("recording", help=recording)
    export.add_argument(
        "--layout",
        required=True,
        choices=("2023", "minari", "lerobot", "parquet"),
        help="the 2023 challenge's (a folder per task), Minari, LeRobot v3.0 (a folder per task), or "
        "the same tables for readers that do not know their encodings (also of a game)",
    )
    export.add_argument(
        "--out",
        metavar="DIR",
        help="output folder; for minari the folder of datasets [default: Minari's own]",
    )
    export.add_argument("--id", metavar="ID", help="id of the Minari dataset, e.g. faceoff/hit/striker-v0")
    export.add_argument("--task", help="one task only [default: all; for minari the one that the id names]")
    export.set_defaults(run=_export)
    return parser


def _info(options: argparse.Namespace) -> None:
    recording = open(options.recording)
    summary = _summarise_game(recording) if isinstance(recording, Game) else _summarise_dataset(recording)
    if options.json:
        print(json.dumps(summary))
        return
    for key, value in summary.items():
        if isinstance(value, dict):
            print(f"{key}:")
            for name, inner in value.items():
                print(f"  {name}: {json.dumps(inner)}")
        else:
            print(f"{key}: {value}")


def _summarise_dataset(dataset: Dataset) -> dict[str, Any]:
    tasks = {}
    for task in dataset.tasks:
        episodes = dataset.episodes(task)
        tasks[task] = {
            "episodes": len(episodes),
            "successes": sum(episode.success for episode in episodes),
            "steps": sum(episode.steps for episode in episodes),
            "ends": dict(Counter(episode.end for episode in episodes)),
            "violated": dict(Counter(group for e in episodes for group in sorted(e.violated))),
        }
    return {
        "layout": dataset.layout,
        "agent": dataset.agent,
        "profile": dataset.profile,
        "ruleset": dataset.ruleset,
        "seed": dataset.seed,
        "tasks": tasks,
    }


def _summarise_game(game: Game) -> dict[str, Any]:
    return {
        "layout": game.layout,
        "agents": list(game.agents),
        "profile": game.manifest.get("profile"),
        "ruleset": game.manifest.get("ruleset"),
        "sides": list(game.sides),
        "steps": sum(rally.steps for rally in game),
        "rallies": len(game),
        "ends": dict(Counter(rally.end for rally in game)),
        "score": list(game.rallies[-1].score) if len(game) else [0, 0],
    }


def _export(options: argparse.Namespace) -> None:
    if options.layout == "parquet":
        _export_parquet(options)
        return
    dataset = open_dataset(options.recording)
    if options.layout == "minari":
        if options.id is None:
            raise ArgumentError("--id: expected an id such as faceoff/hit/striker-v0, got none")
        exported = to_minari(dataset, options.id, task=options.task, root=options.out)
        print(f"{options.id}: {exported.total_episodes} episodes, {exported.total_steps} steps")
        return
    if options.out is None:
        raise ArgumentError(f"--out: expected a folder for the layout {options.layout}, got none")
    if options.layout == "2023":
        if options.task is not None:
            raise ArgumentError("--task: the layout 2023 has all tasks, leave it out")
        for folder in to_2023(dataset, options.out):
            print(folder)
        return
    dataset.check()
    for task in dataset.tasks if options.task is None else [options.task]:
        print(to_lerobot(dataset, f"{options.out}/{task}", task))


def _export_parquet(options: argparse.Namespace) -> None:
    if options.out is None:
        raise ArgumentError("--out: expected a folder for the layout parquet, got none")
    if options.task is not None:
        raise ArgumentError("--task: the layout parquet has all tasks, leave it out")
    for path in to_parquet(open(options.recording), options.out):
        print(path)


if __name__ == "__main__":
    sys.exit(main())
