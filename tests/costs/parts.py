"""The measurements of all parts. Each adds its rows to the report."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass

import changes
import elf
import sources
import units
from changes import Change
from clone import Clone
from report import Report
from runs import Failed, Run

# The beginnings of lines that `faceoff demo` prints (crates/faceoff/src/commands/demo.rs) when it starts, and when the board is there.
START_LINE, BOARD_LINE = "1. starting the server", "4. the board"
# Texts of the report's column “how”.
FRESH = "from a fresh clone, with an empty target folder"
CPU = "user and system time of all processes"


@dataclass
class Measurement:
    report: Report
    rounds: int
    # The requested parts.
    wanted: set[str]
    # Creates a fresh clone with this name.
    clone: Callable[[str], AbstractContextManager[Clone]]
    say: Callable[[str], None]
    # Reported at the end, after the measurements.
    failures: list[str]

    def add_units(self, what: str, clone: Clone) -> None:
        """Adds the units of the first round: they are the same in each round."""
        if "crates" in self.wanted and what not in self.report.units:
            self.report.units[what] = units.read(clone.timings())


def time_of(run: Run, text: str) -> float:
    if text not in run.line_times:
        raise Failed(f"`make demo` never printed a line that begins with “{text}”, as commands/demo.rs does; its log is {run.log}")
    return run.line_times[text]


def demo(measurement: Measurement) -> None:
    runs = []
    for number in range(1, measurement.rounds + 1):
        measurement.say(f"make demo, {number} of {measurement.rounds}")
        with measurement.clone(f"demo-{number}") as clone:
            # Any free port: another server may run here.
            run = clone.make("demo", "SERVE=0", "LISTEN=127.0.0.1:0", texts=(START_LINE, BOARD_LINE)).require_success()
            measurement.add_units("make demo", clone)
        runs.append(run)
    add, how = measurement.report.add, f"`make demo SERVE=0` {FRESH}"
    add("`make demo`, until it is built", [time_of(run, START_LINE) for run in runs], "s", f"{how}: until “{START_LINE}”")
    add("`make demo`, until the board is available", [time_of(run, BOARD_LINE) for run in runs], "s", f"{how}: until “{BOARD_LINE}”")
    add("`make demo`, to its end", [run.wall_s for run in runs], "s", how)
    add("`make demo`, CPU", [run.cpu_s for run in runs], "CPU s", CPU)


def test(measurement: Measurement) -> None:
    runs = []
    for number in range(1, measurement.rounds + 1):
        measurement.say(f"make test, {number} of {measurement.rounds}")
        with measurement.clone(f"test-{number}") as clone:
            run = clone.make("test")
        if run.status != 0:
            measurement.failures.append(run.failure())
        runs.append(run)
    add = measurement.report.add
    add("`make test`", [run.wall_s for run in runs], "s", f"`make test` {FRESH}")
    add("`make test`, CPU", [run.cpu_s for run in runs], "CPU s", CPU)
    add("`make test`, exit status", [run.status for run in runs], "", "0: all tests passed")
    measurement.report.steps["make test"] = runs[0].steps


def changed_lines(measurement: Measurement) -> None:
    """Page, template and store, in one target folder in which everything was built before."""
    wanted: list[Change] = []
    if "page" in measurement.wanted:
        wanted += [changes.PAGE, changes.TEMPLATE]
    if "store" in measurement.wanted:
        wanted += [changes.STORE]
    with measurement.clone("changes") as clone:
        measurement.say("build of programs and tests, before the changes")
        command = ["cargo", "build", "--locked", "--workspace", "--bins", "--tests", "--timings"]
        build = clone.run(command).require_success()
        name = "cargo build --workspace --bins --tests"
        add = measurement.report.add
        add(f"`{name}`", [build.wall_s], "s", FRESH)
        add(f"`{name}`, CPU", [build.cpu_s], "CPU s", CPU)
        measurement.add_units(name, clone)
        for change in wanted:
            measurement.say(f"changing {change.label}")
            unchanged, runs = changes.measure(change, clone)
            how = f"`{' '.join(runs[0].command)}`"
            add(f"{change.label}, until its test has run", [run.wall_s for run in runs], "s", f"{change.file}; {how}")
            add(f"{change.label}, CPU", [run.cpu_s for run in runs], "CPU s", CPU)
            add(f"{change.label}: the same test before it", [unchanged.wall_s], "s", "includes what a build of one package compiles again")


def release(measurement: Measurement) -> None:
    command = ["cargo", "build", "--release", "--locked", "--package", "faceoff", "--timings"]
    name = "cargo build --release --package faceoff"
    runs, found = [], []
    for number in range(1, measurement.rounds + 1):
        measurement.say(f"the release program, {number} of {measurement.rounds}")
        with measurement.clone(f"release-{number}") as clone:
            runs.append(clone.run(command).require_success())
            measurement.add_units(name, clone)
            program = clone.target / "release/faceoff"
            size, found = program.stat().st_size, elf.sections(program)
    if "release" not in measurement.wanted:
        return
    add = measurement.report.add
    add(f"`{name}`", [run.wall_s for run in runs], "s", FRESH)
    add(f"`{name}`, CPU", [run.cpu_s for run in runs], "CPU s", CPU)
    add("release program", [size], "bytes", "`target/release/faceoff`")
    add_sections(measurement.report, size, found)


def add_sections(report: Report, size: int, found: list[elf.Section]) -> None:
    """Adds each section with at least 1 % of the program, and the sum of all others."""
    large = [section for section in found if section.bytes * 100 >= size]
    for section in large:
        report.add(f"release program, `{section.name}`", [section.bytes], "bytes", "section headers")
    report.add("release program, all other sections", [size - sum(section.bytes for section in large)], "bytes", "headers and small sections")
    surplus = elf.debug_sections(found)
    names = ", ".join(f"`{name}`" for name in surplus)
    report.add("release program, sections for debuggers", [len(surplus)], "", names or "no symbol table, no `.debug_*`")


def lines(measurement: Measurement) -> None:
    measurement.say("lines, profiles and dependencies")
    with measurement.clone("lines") as clone:
        found = sources.overrides(clone.source / "Cargo.toml")
        graph = sources.graph(clone.source)
        measurement.report.lines = sources.lines_by_crate(clone.source)
    several = sources.with_several_versions(graph)
    names = "; ".join(f"{name} {', '.join(sorted(versions))}" for name, versions in sorted(several.items()))
    add = measurement.report.add
    add("overrides of single packages", [len(found)], "", "tables `profile.*.package.*` in `Cargo.toml`")
    add("crates that are compiled", [sum(map(len, graph.values()))], "", "names and versions in `cargo tree --workspace`")
    add("crates in more than one version", [len(several)], "", names or "none")
