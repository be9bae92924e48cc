#!/usr/bin/env python3
"""Runs the first hour of docs/start.md as an ordinary user of a fresh Debian, with the commands of the guide, against a server.

It needs root and debootstrap. Lines that begin with sudo are not run in order: the packages in them are installed when the Debian is made.
The blocks of the guide's later sections are not run; they train agents, or have steps for an editor.
"""

import argparse
import json
import re
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import guide
from machine import HOME, Machine, debian

REPOSITORY = Path(__file__).resolve().parents[2]
PAGE = REPOSITORY / "docs/start.md"
SECTION = "## First hour: an agent on the board"
INSTALL = re.compile(r"^\$ sudo apt-get install (.*)$", re.MULTILINE)
LISTEN = "127.0.0.1:8080"
# Time limits that a slow machine does not reach, and no agents in memory.
CONFIG = (REPOSITORY / "tests/long_time_limits.toml").read_text() + "\n[workers]\nslots = 1\n[sandbox]\nresident_bytes = 0\n"


def packages() -> list[str]:
    """The Debian packages that the guide says to install."""
    found = INSTALL.search(PAGE.read_text())
    if not found:
        raise SystemExit(f"error: {PAGE} has no line like `$ sudo apt-get install PACKAGE…`")
    return found.group(1).split()


@contextmanager
def server(machine: Machine, program: Path) -> Iterator[str]:
    """Starts a server in the machine's network, and returns an invitation link for a new team."""
    with tempfile.TemporaryDirectory(prefix="first-hour-") as folder:
        config, data, log = (Path(folder) / name for name in ("faceoff.toml", "data", "log"))
        config.write_text(CONFIG)
        in_network = [*machine.enter("--net"), str(program)]
        options = ["--config", str(config), "--data-dir", str(data), "--listen", LISTEN]
        with log.open("w") as errors:
            process = subprocess.Popen([*in_network, "serve", *options], stdout=subprocess.PIPE, stderr=errors, text=True)
        try:
            if not process.stdout.readline():
                raise SystemExit(f"error: the server did not start:\n{log.read_text()}")
            invite = ["admin", "people", "invite-team", "Ada", "--data-dir", str(data), "--server", f"http://{LISTEN}", "--json"]
            invited = subprocess.run([*in_network, *invite], stdout=subprocess.PIPE, text=True, check=True)
            yield json.loads(invited.stdout)["link"]
        finally:
            process.terminate()
            process.wait()


def run(machine: Machine, link: str) -> None:
    """Runs the commands one after another in one shell session, whose working folder is kept."""
    folder = HOME
    for command in guide.commands(PAGE, SECTION):
        if command.text.startswith("sudo "):
            # Done when the machine was made: its user may not install anything.
            continue
        text = command.text.replace("LINK", link)
        done = machine.run(f"{text}\nstatus=$?; pwd >/tmp/folder; exit $status", folder, {"FACEOFF_CONFIG": "/tmp/faceoff.toml"})
        place = f"{PAGE.relative_to(REPOSITORY)}:{command.line}: $ {command.text}"
        if done.returncode != 0:
            raise SystemExit(f"{place}\nfailed with exit status {done.returncode}; its output:\n{done.stdout}")
        different = guide.difference(command.output, done.stdout)
        if different:
            raise SystemExit(f"{place}\nprints something else than the guide:\n{different}\nthe whole output:\n{done.stdout}")
        print(f"ok    {place}", flush=True)
        folder = machine.run("cat /tmp/folder").stdout.strip()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", required=True, type=Path, help="the built faceoff")
    parser.add_argument("--cache", required=True, type=Path, help="folder for Debian's files, which are kept")
    parser.add_argument("--suite", default="bookworm", help="Debian's version")
    options = parser.parse_args()
    program = options.program.resolve()
    root = debian(options.suite, packages(), options.cache.resolve())
    limits = f"cat >/tmp/faceoff.toml <<'END'\n{CONFIG}END"
    with Machine(root, program, setup=limits) as machine, server(machine, program) as link:
        run(machine, link)


if __name__ == "__main__":
    main()
