"""What building and testing cost: `make costs` measures it from fresh clones of HEAD and prints a table in Markdown.

    python3 tests/costs/costs.py [--only demo,test,page,store,release,crates,lines] [--rounds N] [--json FILE]

demo     make demo, until its board is there
test     make test, and its steps
page     a changed line in a page, and one in a page's template, until their test has run
store    the same of the store
release  the release program: its build, its size and its sections
crates   what each crate takes in the compiler, in whatever of demo, page, store and release is measured (otherwise in release)
lines    lines of Rust by crate, profile overrides, dependencies

Nothing else should run: the figures are the machine's. Nothing is asserted here; docker/check-program.sh checks the release's bounds.
Progress and errors go to standard error; the status is 1 if something could not be measured, or `make test` has failed.
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
    parser.add_argument("--only", default="", metavar="PARTS", help=f"of {','.join(PARTS)}; all if left out")
    parser.add_argument("--rounds", type=int, default=1, help="how often demo, test and release are measured, each in a fresh clone")
    parser.add_argument("--commit", default="HEAD", help="what is measured: a commit of this repository")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the numbers there, too")
    parser.add_argument("--folder", type=Path, help="where clones and targets are made; TMPDIR or the target folder if left out")
    parser.add_argument("--downloads", action="store_true", help="with an empty CARGO_HOME each time, so that downloads count")
    parser.add_argument("--keep", action="store_true", help="leave clones and targets where they are")
    return parser.parse_args()


def parse_parts(only: str) -> set[str]:
    named = {name.strip() for name in only.split(",") if name.strip()}
    if unknown := sorted(named - set(PARTS)):
        raise Failed(f"expected parts of {','.join(PARTS)}, got {','.join(unknown)}")
    return named or set(PARTS)


def field_of(file: str, name: str) -> str:
    """The first value of a file in /proc."""
    values = (line.split(":", 1)[1] for line in Path(file).read_text().splitlines() if line.startswith(name) and ":" in line)
    return next(values, "unknown").strip()


def describe_machine(commit: str) -> str:
    cpus = len(os.sched_getaffinity(0))
    memory = int(field_of("/proc/meminfo", "MemTotal").split()[0]) * 1024 / 1e9
    load = os.getloadavg()[0]
    if load > cpus / 4:
        say(f"this machine is not idle: its load is {load:.1f}, and what else it does is measured, too")
    compiler = capture(["rustc", "--version"], REPOSITORY).split(" (")[0]
    return (
        f"{cpus} CPUs ({field_of('/proc/cpuinfo', 'model name')}), {memory:.0f} GB of memory, "
        f"load {load:.1f} at the start, {compiler}, commit {commit[:10]}"
    )


def resolve_commit(revision: str) -> str:
    if revision == "HEAD" and capture(["git", "status", "--porcelain", "--untracked-files=no"], REPOSITORY):
        say("what is not committed is not measured")
    return capture(["git", "rev-parse", "--verify", f"{revision}^{{commit}}"], REPOSITORY).strip()


def plan(wanted: set[str]) -> list[Callable[[Measurement], None]]:
    """The measurements that these parts need."""
    found: list[Callable[[Measurement], None]] = []
    if "lines" in wanted:
        found.append(parts.lines)
    if "demo" in wanted:
        found.append(parts.demo)
    if "release" in wanted or wanted & {"crates", "demo", "page", "store"} == {"crates"}:
        found.append(parts.release)
    if wanted & {"page", "store"}:
        found.append(parts.changed_lines)
    if "test" in wanted:
        found.append(parts.test)
    return found


def say(words: str) -> None:
    print(f"costs: {words}", file=sys.stderr, flush=True)


def measure(measurement: Measurement) -> None:
    """A measurement that fails leaves the others their figures."""
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
    above = options.folder or default_folder()
    above.mkdir(parents=True, exist_ok=True)
    folder = Path(tempfile.mkdtemp(prefix="costs-", dir=above.resolve()))
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
        # The logs stay if they are needed.
        if not failures and not options.keep:
            shutil.rmtree(folder, ignore_errors=True)
    for failure in failures:
        say(f"error: {failure}")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
