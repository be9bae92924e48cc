"""The measurements, as Markdown for docs/contributing/building.md and as JSON."""

import statistics
from dataclasses import asdict, dataclass, field

from runs import Step
from sources import Lines
from units import Crate, Unit, by_crate, total

# The slowest crates, which are listed; the others are one row.
MAX_CRATES = 25
# Shorter steps are not listed.
MIN_STEP_S = 1.0


@dataclass(frozen=True)
class Row:
    # The measured quantity.
    what: str
    # One per round.
    values: list[float]
    unit: str
    # The command, or what the number includes.
    how: str

    def text(self) -> str:
        """The median, followed by all values if there are several."""
        text = number(statistics.median(self.values), self.unit)
        if len(self.values) > 1:
            text += " (" + ", ".join(number(value, self.unit).removesuffix(f" {self.unit}") for value in self.values) + ")"
        return text


@dataclass
class Report:
    machine: str
    rows: list[Row] = field(default_factory=list)
    # The steps of the recipes, by make target.
    steps: dict[str, list[Step]] = field(default_factory=dict)
    # The units of cargo's report, by build.
    units: dict[str, list[Unit]] = field(default_factory=dict)
    lines: list[Lines] = field(default_factory=list)

    def add(self, what: str, values: list[float], unit: str, how: str) -> None:
        self.rows.append(Row(what, values, unit, how))

    def markdown(self) -> str:
        parts = [self.machine]
        if self.rows:
            rows = [[row.what, row.text(), row.how] for row in self.rows]
            parts.append(table(["what", "measured", "how"], rows))
        parts += [f"Steps of `{what}` of {MIN_STEP_S:.0f} s and more:\n\n" + steps_table(steps) for what, steps in self.steps.items()]
        parts += [crates_section(what, by_crate(units)) for what, units in self.units.items()]
        if self.lines:
            parts.append("Lines of Rust:\n\n" + lines_table(self.lines))
        return "\n\n".join(parts) + "\n"

    def json(self) -> dict[str, object]:
        return {
            "machine": self.machine,
            "rows": [asdict(row) for row in self.rows],
            "steps": {what: [asdict(step) for step in steps] for what, steps in self.steps.items()},
            "crates": {what: [asdict(crate) for crate in by_crate(units)] for what, units in self.units.items()},
            "lines": [asdict(lines) for lines in self.lines],
        }


def number(value: float, unit: str) -> str:
    """Seconds below ten with one decimal, all other numbers without; thousands are separated by commas."""
    if "s" in unit.split() and value < 10:
        return f"{value:.1f} {unit}"
    return f"{value:,.0f} {unit}".rstrip()


def table(head: list[str], rows: list[list[str]]) -> str:
    """Columns of numbers are aligned to the right."""
    numeric = [bool(rows) and all(row[k][:1].isdigit() for row in rows) for k in range(len(head))]
    rule = ["---:" if is_number else "---" for is_number in numeric]
    lines = [head, rule, *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def steps_table(steps: list[Step]) -> str:
    """A table of all steps, without nested makes, whose own steps are listed."""
    shown = [step for step in steps if step.wall_s >= MIN_STEP_S and "--no-print-directory" not in step.line]
    start = min((step.began for step in steps), default=0.0)
    rows = [
        [
            f"`{step.target}`",
            f"`{shorten(step.line)}`",
            number(step.began - start, "s"),
            number(step.wall_s, "s"),
            number(step.cpu_s, "s"),
            str(step.status),
        ]
        for step in shown
    ]
    return table(["target", "command", "from", "time", "CPU", "status"], rows)


def shorten(line: str, max_length: int = 60) -> str:
    text = " ".join(line.replace("\\\n", " ").replace("`", "'").split())
    return text if len(text) <= max_length else text[: max_length - 1] + "…"


def crates_section(what: str, crates: list[Crate]) -> str:
    all_crates = total(crates)
    shown, rest = crates[:MAX_CRATES], crates[MAX_CRATES:]
    rows = [
        [crate.name, number(crate.total_s, "s"), number(crate.frontend_s, "s"), str(crate.units)]
        for crate in shown + ([total(rest)] if rest else [])
    ]
    return (
        f"`{what}`: {all_crates.units} units, {all_crates.total_s:,.0f} s in the compiler, {all_crates.frontend_s:,.0f} s of them "
        "before code generation (cargo does not report it for programs). Wall-clock seconds, while other units run:\n\n"
        + table(["crate", "seconds", "of them front end", "units"], rows)
    )


def lines_table(lines: list[Lines]) -> str:
    rows = [[one.crate, f"{one.source:,}", f"{one.tests:,}"] for one in lines]
    rows.append(["all", f"{sum(one.source for one in lines):,}", f"{sum(one.tests for one in lines):,}"])
    return table(["crate", "src", "tests, benches, examples"], rows)
