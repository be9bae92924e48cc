"""A fresh clone of the repository, with an empty target folder."""

import os
import shutil
import subprocess
from pathlib import Path

from runs import Failed, Run, run

REPOSITORY = Path(__file__).resolve().parents[2]
BIN = Path(__file__).resolve().parent / "bin"
# Variables of the calling make: its jobs and options must not affect the measured ones.
MAKE_VARIABLES = ("MAKEFLAGS", "MFLAGS", "MAKELEVEL", "MAKEOVERRIDES", "MAKE_TERMOUT", "MAKE_TERMERR", "GNUMAKEFLAGS")


def capture(command: list[str], folder: Path) -> str:
    """The output of a short command that must succeed."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=600)
    if done.returncode != 0:
        raise Failed(f"`{' '.join(command)}` in {folder} ended with status {done.returncode}:\n{done.stderr.strip()}")
    return done.stdout


def default_folder() -> Path:
    """TMPDIR, or the target folder: builds need much disk space, and runtimes of agents must not be in /tmp."""
    target = Path(os.environ.get("CARGO_TARGET_DIR") or "target")
    return Path(os.environ.get("TMPDIR") or REPOSITORY / target)


class Clone:
    """A context manager. Its end removes clone and target folder, but not the logs."""

    def __init__(self, name: str, commit: str, folder: Path, downloads: bool = False, keep: bool = False):
        self.name, self.commit, self.keep = name, commit, keep
        self.logs, self.folder = folder / "logs", folder / name
        self.source, self.target = self.folder / "faceoff", self.folder / "target"
        self.cargo_home = self.folder / "cargo" if downloads else None
        self.runs = 0

    def __enter__(self) -> "Clone":
        self.logs.mkdir(parents=True, exist_ok=True)
        self.folder.mkdir()
        capture(["git", "clone", "--quiet", "--no-checkout", str(REPOSITORY), str(self.source)], self.folder)
        capture(["git", "checkout", "--quiet", "--detach", self.commit], self.source)
        if self.cargo_home:
            self.create_cargo_home(self.cargo_home)
        return self

    def __exit__(self, *_: object) -> None:
        if not self.keep:
            shutil.rmtree(self.folder, ignore_errors=True)

    def create_cargo_home(self, folder: Path) -> None:
        """Creates a CARGO_HOME without downloads, with the user's configuration of registries."""
        folder.mkdir()
        own = Path(os.environ.get("CARGO_HOME") or Path.home() / ".cargo")
        for name in ("config.toml", "config"):
            if (own / name).is_file():
                shutil.copy(own / name, folder / name)

    def env(self) -> dict[str, str]:
        env = {name: value for name, value in os.environ.items() if name not in MAKE_VARIABLES}
        env |= {
            "CARGO_TARGET_DIR": str(self.target),
            "PATH": f"{BIN}{os.pathsep}{env.get('PATH', os.defpath)}",
            # A cache of compiled crates would falsify the times.
            "RUSTC_WRAPPER": "",
        }
        if self.cargo_home:
            env["CARGO_HOME"] = str(self.cargo_home)
        return env

    def run(self, command: list[str], texts: tuple[str, ...] = ()) -> Run:
        self.runs += 1
        return run(command, self.source, self.env(), self.logs / f"{self.name}-{self.runs}.log", texts)

    def make(self, *arguments: str, texts: tuple[str, ...] = ()) -> Run:
        """Runs make. Records the time of its recipe lines, and that of each crate."""
        options = ["CARGO=timed-cargo", "SHELL=recipe-shell", ".SHELLFLAGS=$@ -c"]
        return self.run(["make", *arguments, *options], texts)

    def timings(self) -> Path:
        return self.target / "cargo-timings/cargo-timing.html"
