"""Checks that a build of the whole workspace compiles no crate twice because of its features, and that the wheel of Python's tests
reuses the crates of that build: see crates/workspace-hack/Cargo.toml. Run it after `cargo build --workspace --bins --tests`.

    python3 tests/costs/compiled_once.py
"""

import json
import os
import subprocess
import sys
import tomllib
from collections import defaultdict
from pathlib import Path
from typing import NamedTuple

REPOSITORY = Path(__file__).resolve().parents[2]


class Library(NamedTuple):
    """A compiled library or macro, with its file, whose name has a hash of features and dependencies."""

    package: str
    features: tuple[str, ...]
    file: str


def built_libraries(*arguments: str) -> set[Library]:
    """Runs `cargo build`, which has little to do, and returns the libraries that its targets use."""
    command = [os.environ.get("CARGO", "cargo"), "build", "--locked", "--quiet", "--message-format", "json", *arguments]
    output = subprocess.run(command, cwd=REPOSITORY, stdout=subprocess.PIPE, check=True, text=True).stdout
    libraries = set()
    for message in map(json.loads, output.splitlines()):
        # A crate with unit tests is compiled again for them.
        if message["reason"] != "compiler-artifact" or message["profile"]["test"]:
            continue
        if {"lib", "proc-macro"} & set(message["target"]["kind"]):
            # The last file, since the first one of a requested library is a copy without the hash.
            libraries.add(Library(message["package_id"], tuple(message["features"]), message["filenames"][-1]))
    return libraries


def wheel_arguments() -> list[str]:
    """The crates of the workspace that the wheel of Python's tests contains, with their features there."""
    manifest = tomllib.loads((REPOSITORY / "crates/faceoff-py/Cargo.toml").read_text())
    own = [name for name in manifest["dependencies"] if name.startswith(("faceoff-", "workspace-"))]
    features = [feature for feature in manifest["features"]["as-in-the-workspace"] if "/" in feature]
    return [*(f"--package={name}" for name in own), "--features", ",".join(features)]


def short_name(package: str) -> str:
    return package.rpartition("/")[2].rpartition("index#")[2]


def differences(libraries: list[Library]) -> str:
    """The features that not all of them have. Without any, the difference is in a dependency."""
    common = set.intersection(*(set(library.features) for library in libraries))
    variants = {", ".join(sorted(set(library.features) - common)) or "none of them" for library in libraries}
    return " / ".join(sorted(variants)) if len(variants) > 1 else "the same features, so a dependency differs"


def find_repetitions(workspace: set[Library], wheel: set[Library]) -> list[str]:
    """A line for each crate of which the builds use more than one file."""
    variants: dict[str, list[Library]] = defaultdict(list)
    for library in sorted(workspace):
        variants[library.package].append(library)
    found = [f"twice in the workspace: {short_name(package)}: {differences(several)}" for package, several in variants.items() if len(several) > 1]
    for library in sorted(wheel - workspace):
        if same_package := variants.get(library.package):
            found.append(f"again for the wheel: {short_name(library.package)}: {differences([*same_package, library])}")
    return found


def main() -> int:
    found = find_repetitions(built_libraries("--workspace", "--bins", "--tests"), built_libraries("--lib", *wheel_arguments()))
    if found:
        print("crates are compiled more than once; add the features to crates/workspace-hack/Cargo.toml:", *found, sep="\n  ", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
