"""Measures the time and size of builds and tests: `make costs` uses fresh clones of HEAD and prints a Markdown table.

    python3 tests/costs/costs.py [--only demo,test,page,store,release,crates,lines] [--rounds N] [--json FILE]

demo     make demo, until the board is available
test     make test, with its steps
page     from a changed line in a page, or in a page's template, until its test has run
store    the same for a line in the store
release  the release program: build time, size and sections
crates   compile time of each crate, in the measured builds of demo, page, store and release (of release if there are none)
lines    lines of Rust by crate, profile overrides, dependencies

Run nothing else meanwhile. The program checks no limits; docker/check-program.sh checks those of the release. Progress and errors go
to standard error. The status is 1 if a measurement or `make test` failed.
"""

import argparse
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import parts
from clone import REPOSITORY, Clone, capture, default_folder
from parts import Measurement
from report import Report
from runs import Failed

PARTS = ("demo", "test", "page", "store", "release", "crates", "lines")


def arguments() -> argparse.Namespace:
    head, _, rest = (__doc__ or "").partition("\n\n")
    parser = argparse.ArgumentParser(description=head, epilog=rest, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", metavar="PARTS", help=f"parts to measure, of {','.join(PARTS)}; default: all")
    parser.add_argument("--rounds", type=int, default=1, help="number of measurements of demo, test and release, each in a fresh clone")
    parser.add_argument("--commit", default="HEAD", help="commit of this repository to measure")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the numbers to this file")
    parser.add_argument("--folder", type=Path, help="folder for clones and targets; default: TMPDIR or the target folder")
    parser.add_argument("--downloads", action="store_true", help="use an empty CARGO_HOME, so that downloads are included")
    parser.add_argument("--keep", action="store_true", help="do not remove clones and targets")
    return parser.parse_args()


def parse_parts(only: str) -> set[str]:
    named = {name.strip() for name in only.split(",") if name.strip()}
    if unknown := sorted(named - set(PARTS)):
        raise Failed(f"expected parts of {','.join(PARTS)}, got {','.join(unknown)}")
    return named or set(PARTS)


def field_of(file: str, name: str) -> str:
    """The first value with this name in a file of /proc."""
    values = (line.split(":", 1)[1] for line in Path(file).read_text().splitlines() if line.startswith(name) and ":" in line)
    return next(values, "unknown").strip()


def describe_machine(commit: str) -> str:
    cpus = len(os.sched_getaffinity(0))
    memory = int(field_of("/proc/meminfo", "MemTotal").split()[0]) * 1024 / 1e9
    load = os.getloadavg()[0]
    if load > cpus / 4:
        say(f"this machine is not idle: its load is {load:.1f}, which affects the measurements")
    compiler = capture(["rustc", "--version"], REPOSITORY).split(" (")[0]
    return (
        f"{cpus} CPUs ({field_of('/proc/cpuinfo', 'model name')}), {memory:.0f} GB of memory, "
        f"load {load:.1f} at the start, {compiler}, commit {commit[:10]}"
    )


def resolve_commit(revision: str) -> str:
    if revision == "HEAD" and capture(["git", "status", "--porcelain", "--untracked-files=no"], REPOSITORY):
        say("uncommitted changes are not measured")
    return capture(["git", "rev-parse", "--verify", f"{revision}^{{commit}}"], REPOSITORY).strip()


def plan(wanted: set[str]) -> list[Callable[[Measurement], None]]:
    """The measurements needed for these parts."""
    steps: list[Callable[[Measurement], None]] = []
    if "lines" in wanted:
        steps.append(parts.lines)
    if "demo" in wanted:
        steps.append(parts.demo)
    if "release" in wanted or wanted & {"crates", "demo", "page", "store"} == {"crates"}:
        steps.append(parts.release)
    if wanted & {"page", "store"}:
        steps.append(parts.changed_lines)
    if "test" in wanted:
        steps.append(parts.test)
    return steps


def say(text: str) -> None:
    print(f"costs: {text}", file=sys.stderr, flush=True)


def measure(measurement: Measurement) -> None:
    """Runs all measurements. If one fails, the others are still reported."""
    for step in plan(measurement.wanted):
        try:
            step(measurement)
        except Failed as failed:
            measurement.failures.append(str(failed))


def prepare(options: argparse.Namespace, folder: Path) -> Measurement:
    if options.rounds < 1:
        raise Failed(f"--rounds: expected at least 1, got {options.rounds}")
    wanted, commit = parse_parts(options.only), resolve_commit(options.commit)

    def clone(name: str) -> Clone:
        return Clone(name, commit, folder, options.downloads, options.keep)

    return Measurement(Report(describe_machine(commit)), options.rounds, wanted, clone, say, [])


def main() -> int:
    options = arguments()
    parent = options.folder or default_folder()
    parent.mkdir(parents=True, exist_ok=True)
    folder = Path(tempfile.mkdtemp(prefix="costs-", dir=parent.resolve()))
    failures: list[str] = []
    try:
        measurement = prepare(options, folder)
        failures = measurement.failures
        measure(measurement)
        print(measurement.report.markdown(), end="")
        if options.json:
            options.json.write_text(json.dumps(measurement.report.json(), indent=1) + "\n")
    except Failed as failed:
        say(f"error: {failed}")
        return 1
    finally:
        # Keep the logs if there are failures.
        if not failures and not options.keep:
            shutil.rmtree(folder, ignore_errors=True)
    for failure in failures:
        say(f"error: {failure}")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
