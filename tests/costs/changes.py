"""The time from a change of one line until its test has run."""

import re
from dataclasses import dataclass
from pathlib import Path

from clone import Clone
from runs import Failed, Run

ROUNDS = 3


@dataclass(frozen=True)
class Change:
    """A line of a file that becomes another one, whose `#` is the number of the change."""

    what: str
    file: str
    line: str
    becomes: str
    # Its test: `cargo nextest run -p PACKAGE --test it TESTS`.
    package: str
    tests: str


# When files, crates or tests are renamed, these follow.
PAGE = Change(
    what="a line in a page",
    file="crates/faceoff-pages/src/help.rs",
    line='            row("Scratch files in /tmp", |limits| {',
    becomes='            row("Scratch files in /tmp #", |limits| {',
    package="faceoff-http",
    tests="runtimes::",
)
TEMPLATE = Change(
    what="a line in a page's template",
    file="web/templates/help.html",
    line="    <div><dt>GPU</dt><dd>none</dd></div>",
    becomes="    <div><dt>GPU</dt><dd>none #</dd></div>",
    package="faceoff-http",
    tests="runtimes::",
)
STORE = Change(
    what="a line in the store",
    file="crates/faceoff-store/src/tables/teams.rs",
    line='    let teams = select_teams!("ORDER BY name").fetch_all(connection).await?;',
    becomes='    let teams = select_teams!("ORDER BY name").fetch_all(connection).await?; let _ = std::hint::black_box(#);',
    package="faceoff-store",
    tests="teams::",
)


class Edit:
    """The change, made again and again in one file."""

    def __init__(self, change: Change, source: Path):
        self.change, self.file = change, source / change.file
        if not self.file.is_file():
            raise Failed(f"there is no {change.file}, in which {change.what} is to be changed: name another in {__file__}")
        self.pristine = self.file.read_text()
        lines = self.pristine.splitlines().count(change.line)
        if lines != 1:
            raise Failed(f"{change.file} has the line {change.line!r} {lines} times, not once: name another in {__file__}")

    def make(self, number: int) -> None:
        self.file.write_text(self.pristine.replace(self.change.line, self.change.becomes.replace("#", str(number))))


def has_nextest(clone: Clone) -> bool:
    return clone.run(["cargo", "nextest", "--version"]).status == 0


def test_words(change: Change, nextest: bool) -> list[str]:
    """As `make test` runs tests."""
    run = ["nextest", "run"] if nextest else ["test"]
    return ["cargo", *run, "--locked", "-p", change.package, "--test", "it", change.tests]


def check(change: Change, run: Run, compiled: bool) -> Run:
    """Raises if this run shows nothing: no test, or nothing compiled where something was changed."""
    run.require_success()
    text = run.log.read_text(errors="replace")
    if not re.search(r"\b[1-9][0-9]* passed", text):
        raise Failed(f"no test of {change.package} is named {change.tests}…: name others in {__file__}; the log is {run.log}")
    if compiled and f"Compiling {change.package} " not in text:
        raise Failed(f"{change.file} was changed, and {change.package} was not compiled: name another file in {__file__}")
    return run


def measure(change: Change, clone: Clone) -> tuple[Run, list[Run]]:
    """The test without a change after the build of all, and then once after each change."""
    edit = Edit(change, clone.source)
    words = test_words(change, has_nextest(clone))
    unchanged = check(change, clone.run(words), compiled=False)
    changed = []
    for number in range(1, ROUNDS + 1):
        edit.make(number)
        changed.append(check(change, clone.run(words), compiled=True))
    return unchanged, changed
