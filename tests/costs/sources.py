"""Counts lines, profile overrides and dependencies, without compiling."""

import json
import tomllib
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

from clone import capture


@dataclass(frozen=True)
class Lines:
    crate: str
    # Lines in `src`, including unit tests.
    source: int
    # Lines of tests, benchmarks and examples.
    tests: int


def count_lines(files: list[Path]) -> int:
    return sum(len(file.read_text().splitlines()) for file in files)


def lines_by_crate(source: Path) -> list[Lines]:
    metadata = json.loads(capture(["cargo", "metadata", "--no-deps", "--format-version", "1", "--locked"], source))
    folders = {package["name"]: Path(package["manifest_path"]).parent for package in metadata["packages"]}
    found = []
    for name, folder in sorted(folders.items()):
        inner = [other for other in folders.values() if other != folder and folder in other.parents]
        own = [file for file in folder.rglob("*.rs") if not any(other in file.parents for other in inner)]
        in_source = [file for file in own if folder / "src" in file.parents]
        found.append(Lines(name, count_lines(in_source), count_lines(own) - count_lines(in_source)))
    return found


def overrides(manifest: Path) -> list[str]:
    """All tables `profile.P.package.C` of a Cargo.toml."""
    profiles = tomllib.loads(manifest.read_text()).get("profile", {})
    return [f"profile.{name}.package.{package}" for name, profile in profiles.items() for package in profile.get("package", {})]


def versions(tree: str) -> dict[str, set[str]]:
    """The versions of each crate, from the lines `name v1.2.3 …` of `cargo tree --prefix none`."""
    found: dict[str, set[str]] = defaultdict(set)
    for line in tree.splitlines():
        name, version, *_ = line.split() + ["", ""]
        if version.startswith("v") and version[1:2].isdigit():
            found[name].add(version[1:])
    return found


def graph(source: Path) -> dict[str, set[str]]:
    """All crates that are compiled on a machine like this one, for programs, tests and build scripts."""
    command = ["cargo", "tree", "--locked", "--workspace", "--edges", "normal,build,dev", "--prefix", "none", "--format", "{p}"]
    return versions(capture(command, source))


def with_several_versions(crates: dict[str, set[str]]) -> dict[str, set[str]]:
    return {name: found for name, found in crates.items() if len(found) > 1}
