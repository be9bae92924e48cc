"""Compile time by crate, from the report of `cargo build --timings`."""

import json
from dataclasses import dataclass
from pathlib import Path

from runs import Failed

# The report has the units in its script: `const UNIT_DATA = [{"name": …, "duration": …, "sections": [["frontend", {…}], …]}, …];`
DATA_PREFIX = "UNIT_DATA = "


@dataclass(frozen=True)
class Unit:
    """One call of the compiler, or one run of a build script."""

    crate: str
    # Wall-clock seconds, while other units run, too.
    total_s: float
    # The part before code generation: parsing, macros, types.
    frontend_s: float


@dataclass
class Crate:
    """All units of a crate: libraries, programs, tests, build scripts and their runs."""

    name: str
    units: int = 0
    total_s: float = 0.0
    frontend_s: float = 0.0


def read(report: Path) -> list[Unit]:
    """The units of a report. Fails if the report has an unknown format."""
    if not report.is_file():
        raise Failed(f"{report} does not exist: cargo has built nothing, or writes the report of --timings to another file")
    return parse(report.read_text(), report)


def parse(text: str, report: Path) -> list[Unit]:
    try:
        start = text.index(DATA_PREFIX) + len(DATA_PREFIX)
        units, _ = json.JSONDecoder().raw_decode(text, start)
        return [Unit(unit["name"], unit["duration"], frontend_s(unit.get("sections"))) for unit in units]
    except (ValueError, KeyError, TypeError) as error:
        raise Failed(f"{report} has an unknown format: this cargo writes another report than {__file__} expects ({error!r})") from error


def frontend_s(sections: list[tuple[str, dict[str, float]]] | None) -> float:
    frontend = dict(sections or []).get("frontend")
    return frontend["end"] - frontend["start"] if frontend else 0.0


def by_crate(units: list[Unit]) -> list[Crate]:
    """The total of each crate, the slowest first. Versions of a crate are added up."""
    crates: dict[str, Crate] = {}
    for unit in units:
        crate = crates.setdefault(unit.crate, Crate(unit.crate))
        crate.units += 1
        crate.total_s += unit.total_s
        crate.frontend_s += unit.frontend_s
    return sorted(crates.values(), key=lambda crate: (-crate.total_s, crate.name))


def total(crates: list[Crate]) -> Crate:
    """The sum of these crates."""
    return Crate(
        f"all others ({len(crates)} crates)",
        sum(crate.units for crate in crates),
        sum(crate.total_s for crate in crates),
        sum(crate.frontend_s for crate in crates),
    )
