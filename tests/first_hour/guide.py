"""The commands of a page, with the output that the page shows for each."""

import re
from dataclasses import dataclass, field
from pathlib import Path


@dataclass
class Command:
    """One line `$ COMMAND` of a console block, and the lines of output below it."""

    line: int
    text: str
    output: list[str] = field(default_factory=list)


def commands(page: Path, heading: str) -> list[Command]:
    """The commands of the console blocks between this heading and the next one of the same level."""
    level = heading.split()[0]
    is_inside, is_in_block, found = False, False, []
    for number, line in enumerate(page.read_text().splitlines(), 1):
        if not is_in_block and line.startswith(level + " "):
            is_inside = line == heading
        if line.startswith("```"):
            is_in_block = is_inside and line == "```console"
        elif is_in_block and line.startswith("$ "):
            found.append(Command(number, line.removeprefix("$ ")))
        elif is_in_block:
            found[-1].output.append(line)
    if not found:
        raise SystemExit(f"error: {page} has no commands below {heading!r}")
    return found


# Parts of an output that differ between runs: times, what follows from times, ids, dates and addresses, and the episodes of a validation
# run, which follow from the server's secret. Each becomes the word behind it.
VARIABLE = [
    (r"[\d.]+ +(Deployable|Improvable|Non-deployable)", "PENALTY TIER"),
    (r"penalty points [\d.]+, tier: \S+", "PENALTY TIER"),
    (r"(yes|no) +[\d.]+$", r"\1 PENALTY"),
    (r"[\d.]+ penalty points per episode", "PENALTY per episode"),
    (r"\d+ +[\d.]+ / +[\d.]+ / +[\d.]+$", "SLOW STEPS AND TIMES"),
    (r"\b[\d.]+ ?m?s\b", "TIME"),
    (r"\b\d{4}-\d\d-\d\d\b", "DATE"),
    (r"\b[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}\b", "ID"),
    (r"https?://[^\s,]+", "ADDRESS"),
    (r"\d+ answers", "N answers"),
    (r"in \d+ episodes?", "in N episodes"),
    (r" +", " "),
]


def without_variable_parts(line: str) -> str:
    for pattern, word in VARIABLE:
        line = re.sub(pattern, word, line)
    return line.rstrip()


def difference(expected: list[str], output: str) -> str | None:
    """Compares an output with the one on the page, where a line `…` stands for any lines and `…` in a line for any text.
    Returns a description of the first difference."""
    wanted = [without_variable_parts(line) for line in expected]
    while wanted and not wanted[-1]:
        wanted.pop()
    found = [without_variable_parts(line) for line in output.rstrip("\n").splitlines()]
    position, is_any = 0, False
    for line in wanted:
        if line == "…":
            is_any = True
            continue
        pattern = ".*".join(re.escape(part) for part in line.split("…"))
        rest = range(position, len(found) if is_any else min(position + 1, len(found)))
        match = next((index for index in rest if re.fullmatch(pattern, found[index])), None)
        if match is None:
            came = found[position] if position < len(found) else "the end of the output"
            return f"expected: {line}\n     came: {came}"
        position, is_any = match + 1, False
    if wanted and not is_any and position < len(found):
        return f"expected: the end of the output\n     came: {found[position]}"
    return None
