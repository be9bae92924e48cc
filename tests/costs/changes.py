"""Measures the time from a change of one line until its test has run."""

import re
from dataclasses import dataclass
from pathlib import Path

from clone import Clone
from runs import Failed, Run

ROUNDS = 3


@dataclass(frozen=True)
class Change:
    """Replaces a line of a file by another one, in which `#` is the number of the change."""

    # What is changed, for the report.
    label: str
    file: str
    line: str
    replacement: str
    # Its tests: `cargo nextest run -p PACKAGE --test it TESTS`.
    package: str
    tests: str


# Keep these up to date when files, crates or tests are renamed.
PAGE = Change(
    label="a line in a page",
    file="crates/faceoff-pages/src/help.rs",
    line='            row("Scratch files in /tmp", |limits| {',
    replacement='            row("Scratch files in /tmp #", |limits| {',
    package="faceoff-http",
    tests="runtimes::",
)
TEMPLATE = Change(
    label="a line in a page's template",
    file="web/templates/help.html",
    line="    <div><dt>GPU</dt><dd>none</dd></div>",
    replacement="    <div><dt>GPU</dt><dd>none #</dd></div>",
    package="faceoff-http",
    tests="runtimes::",
)
STORE = Change(
    label="a line in the store",
    file="crates/faceoff-store/src/tables/teams.rs",
    line='    let teams = select_teams!("ORDER BY name").fetch_all(connection).await?;',
    replacement='    let teams = select_teams!("ORDER BY name").fetch_all(connection).await?; let _ = std::hint::black_box(#);',
    package="faceoff-store",
    tests="teams::",
)


class Edit:
    """Applies a change repeatedly to one file."""

    def __init__(self, change: Change, source: Path):
        self.change, self.file = change, source / change.file
        if not self.file.is_file():
            raise Failed(f"there is no {change.file}, where {change.label} should be changed: correct it in {__file__}")
        self.original = self.file.read_text()
        lines = self.original.splitlines().count(change.line)
        if lines != 1:
            raise Failed(f"{change.file} has the line {change.line!r} {lines} times, not once: correct it in {__file__}")

    def apply(self, number: int) -> None:
        self.file.write_text(self.original.replace(self.change.line, self.change.replacement.replace("#", str(number))))


def has_nextest(clone: Clone) -> bool:
    return clone.run(["cargo", "nextest", "--version"]).status == 0


def test_command(change: Change, nextest: bool) -> list[str]:
    """The command with which `make test` runs tests."""
    run = ["nextest", "run"] if nextest else ["test"]
    return ["cargo", *run, "--locked", "-p", change.package, "--test", "it", change.tests]


def check(change: Change, run: Run, compiled: bool) -> Run:
    """Raises if this run measured nothing: it ran no test, or did not compile the changed package."""
    run.require_success()
    text = run.log.read_text(errors="replace")
    if not re.search(r"\b[1-9][0-9]* passed", text):
        raise Failed(f"no test of {change.package} is named {change.tests}…: correct the filter in {__file__}; the log is {run.log}")
    if compiled and f"Compiling {change.package} " not in text:
        raise Failed(f"{change.file} was changed, and {change.package} was not compiled: correct the file in {__file__}")
    return run


def measure(change: Change, clone: Clone) -> tuple[Run, list[Run]]:
    """Runs the test once without a change, and then after each change."""
    edit = Edit(change, clone.source)
    command = test_command(change, has_nextest(clone))
    unchanged = check(change, clone.run(command), compiled=False)
    changed = []
    for number in range(1, ROUNDS + 1):
        edit.apply(number)
        changed.append(check(change, clone.run(command), compiled=True))
    return unchanged, changed
