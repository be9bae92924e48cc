#!/usr/bin/env python3
"""Checks the project's words: phrases, names of types, modules and tests, and comments that say nothing.

The list with its reasons is words.toml. Usage: words.py [FOLDER]; without a folder, this project.
Prints a line for each finding; ends with 1 if there is one.
"""

import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
TEXTS = {".rs", ".py", ".ts", ".js", ".sh", ".html", ".css", ".md", ".toml", ".sql", ".yaml", ".txt", ".xml", ".service"}
COMMENT = re.compile(r"^\s*(?:///|//!|//|#)\s?(.*?)\s*$")
ITEM = re.compile(r"^\s*(?:pub(?:\([^)]*\))?\s+)?(?:(struct|enum|trait|type)|(mod))\s+(\w+)")
TEST_ATTRIBUTE = re.compile(r"^\s*#\[(?:\w+::)*(?:test|test_case|rstest)\b")
RUST_FUNCTION = re.compile(r"^\s*(?:pub\s+)?(?:async\s+)?fn\s+(\w+)")
PYTHON_TEST = re.compile(r"^\s*def\s+test_(\w+)\(")


@dataclass(frozen=True)
class Finding:
    """A word that may not be used: `found`, in a line with this text, and what to write in its place."""

    file: str
    line: int
    found: str
    text: str
    instead: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.found}: {self.instead}\n    {self.text.strip()[:160]}"


class Words:
    def __init__(self, path: Path):
        listed = tomllib.loads(path.read_text())
        self.leave_out = tuple(listed["leave_out"])
        self.phrases = [(re.compile(pattern, re.IGNORECASE), instead) for pattern, instead in listed["phrases"].items()]
        self.types = set(listed["identifiers"]["types"])
        self.modules = set(listed["identifiers"]["modules"])
        self.comments = set(listed["comments"]["whole"])
        self.longest = listed["tests"]["longest"]
        self.beginnings = set(listed["tests"]["beginnings"])
        self.exceptions = listed.get("exception", [])
        for exception in self.exceptions:
            if not all(exception.get(key) for key in ("file", "text", "reason")):
                sys.exit(f"an exception has a file, a text and a reason, got {exception}")

    def check(self, file: str, text: str) -> Iterator[Finding]:
        """All findings of one file, exceptions included."""
        is_test = False
        for number, line in enumerate(text.splitlines(), 1):

            def finding(found: str, instead: str, number=number, line=line) -> Finding:
                return Finding(file, number, found, line, instead)

            for pattern, instead in self.phrases:
                for match in pattern.finditer(line):
                    yield finding(match.group(), instead)
            comment = COMMENT.match(line)
            if comment and comment.group(1) in self.comments:
                yield finding(comment.group(1), "a comment says something, or goes")
            if file.endswith(".rs"):
                yield from self.names(line, finding)
                function = RUST_FUNCTION.match(line)
                if TEST_ATTRIBUTE.match(line):
                    is_test = True
                elif function:
                    if is_test:
                        yield from self.test(function.group(1), finding)
                    is_test = False
            elif file.endswith(".py") and (test := PYTHON_TEST.match(line)):
                yield from self.test(test.group(1), finding)
        if file.endswith(".rs"):
            name = Path(file).stem
            if name in self.modules:
                yield Finding(file, 1, name, f"the module {name}", "a noun of the field names a module")

    def names(self, line: str, finding) -> Iterator[Finding]:
        item = ITEM.match(line)
        if item and item.group(1) and item.group(3) in self.types:
            yield finding(item.group(3), "a noun of the field names a type")

    def test(self, name: str, finding) -> Iterator[Finding]:
        if len(name) > self.longest:
            yield finding(name, f"a test's name has at most {self.longest} characters, this has {len(name)}")
        if name.split("_")[0] in self.beginnings:
            yield finding(name, "a test is named subject_condition_expectation")

    def remaining(self, findings: list[Finding]) -> list[Finding]:
        """Findings without an exception, and exceptions without a finding."""
        unused = list(range(len(self.exceptions)))
        remaining = []
        for finding in findings:
            matching = [
                index
                for index, exception in enumerate(self.exceptions)
                if Path(finding.file).match(exception["file"]) and exception["text"] in finding.text
            ]
            unused = [index for index in unused if index not in matching]
            if not matching:
                remaining.append(finding)
        for index in unused:
            exception = self.exceptions[index]
            remaining.append(Finding(exception["file"], 0, exception["text"], exception["reason"], "an exception that nothing needs"))
        return remaining


def files(folder: Path) -> list[str]:
    """Files of the project that have words, by their paths in it."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=folder,
        check=True,
        capture_output=True,
        text=True,
    ).stdout.splitlines()
    named = {"Makefile", "Dockerfile"}
    return [file for file in listed if Path(file).suffix in TEXTS or Path(file).name in named]


def check(folder: Path, words: Words) -> list[Finding]:
    findings = []
    for file in files(folder):
        path = folder / file
        if not file.startswith(words.leave_out) and path.is_file():
            findings += words.check(file, path.read_text())
    return words.remaining(findings)


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE.parent.parent
    findings = check(folder, Words(HERE / "words.toml"))
    for finding in findings:
        print(finding)
    if findings:
        sys.exit(f"{len(findings)} words: tests/words/words.toml says why, and takes exceptions with a reason")


if __name__ == "__main__":
    main()
