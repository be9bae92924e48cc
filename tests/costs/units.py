"""The compiler's time by crate, from the report that `cargo build --timings` writes."""

import json
from dataclasses import dataclass
from pathlib import Path

from runs import Failed

# In the report's script: `const UNIT_DATA = [{"name": …, "duration": …, "sections": [["frontend", {…}], …]}, …];`
DATA = "UNIT_DATA = "


@dataclass(frozen=True)
class Unit:
    """One call of the compiler, or one run of a build script."""

    crate: str
    # Seconds by the clock, while other units run beside it.
    total_s: float
    # Of these, before machine code is made: parsing, macros, types.
    frontend_s: float


@dataclass
class Crate:
    """All units of a crate: libraries, programs, tests, build scripts and their runs."""

    name: str
    units: int = 0
    total_s: float = 0.0
    frontend_s: float = 0.0


def read(report: Path) -> list[Unit]:
    """The units of a report; an error if cargo has written another form of it."""
    if not report.is_file():
        raise Failed(f"{report} is not there: cargo has built nothing, or writes the report of --timings elsewhere")
    return parse(report.read_text(), report)


def parse(text: str, report: Path) -> list[Unit]:
    try:
        start = text.index(DATA) + len(DATA)
        units, _ = json.JSONDecoder().raw_decode(text, start)
        return [Unit(unit["name"], unit["duration"], frontend_s(unit.get("sections"))) for unit in units]
    except (ValueError, KeyError, TypeError) as error:
        raise Failed(f"{report} is not as {__file__} expects it, so this cargo writes another report ({error!r})") from error


def frontend_s(sections: list[tuple[str, dict[str, float]]] | None) -> float:
    frontend = dict(sections or []).get("frontend")
    return frontend["end"] - frontend["start"] if frontend else 0.0


def by_crate(units: list[Unit]) -> list[Crate]:
    """The dearest first. Versions of one crate count together."""
    crates: dict[str, Crate] = {}
    for unit in units:
        crate = crates.setdefault(unit.crate, Crate(unit.crate))
        crate.units += 1
        crate.total_s += unit.total_s
        crate.frontend_s += unit.frontend_s
    return sorted(crates.values(), key=lambda crate: (-crate.total_s, crate.name))


def others(crates: list[Crate]) -> Crate:
    """All of these as one."""
    return Crate(
        f"all others ({len(crates)} crates)",
        sum(crate.units for crate in crates),
        sum(crate.total_s for crate in crates),
        sum(crate.frontend_s for crate in crates),
    )
