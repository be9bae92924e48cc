"""Runs a command to its end, and notes its time, its CPU time and the moments of lines in its log."""

import json
import os
import resource
import shlex
import signal
import subprocess
import time
from dataclasses import dataclass, field
from pathlib import Path

# A bound on a command that hangs: longer than any measured command takes, also on a slow machine.
LIMIT_S = 4 * 3600
# Interval between two looks at the log: moments and ends are exact to this.
LOOK_S = 0.1
LAST_LINES = 30


class Failed(Exception):
    """In words, for the caller."""


@dataclass(frozen=True)
class Step:
    """A line of a recipe of make's."""

    target: str
    line: str
    began: float
    wall_s: float
    cpu_s: float
    status: int


@dataclass(frozen=True)
class Run:
    words: list[str]
    # Seconds from the start to the end, and of CPU, of the process and its descendants that were waited for.
    wall_s: float
    cpu_s: float
    status: int
    log: Path
    # Seconds from the start until a line of the log was this.
    moments: dict[str, float] = field(default_factory=dict)
    steps: list[Step] = field(default_factory=list)

    def failure(self) -> str:
        lines = self.log.read_text(errors="replace").splitlines()[-LAST_LINES:]
        return (
            f"`{shlex.join(self.words)}` ended with status {self.status}; the whole log is {self.log}, "
            f"and this its end:\n" + "\n".join(f"    {line}" for line in lines)
        )

    def require_success(self) -> "Run":
        if self.status != 0:
            raise Failed(self.failure())
        return self


class Watch:
    """Reads a log that grows, and notes when lines come that begin with one of the texts."""

    def __init__(self, log: Path, texts: tuple[str, ...], began: float):
        self.file, self.texts, self.began = log.open("rb"), texts, began
        self.unread = b""
        self.moments: dict[str, float] = {}

    def look(self) -> None:
        now = time.monotonic() - self.began
        *lines, self.unread = (self.unread + self.file.read()).split(b"\n")
        for line in lines:
            for text in self.texts:
                if line.startswith(text.encode()):
                    self.moments.setdefault(text, now)


def cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def kill_group(process: subprocess.Popen[bytes]) -> None:
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass


def wait(process: subprocess.Popen[bytes], watch: Watch, words: list[str], limit_s: float) -> None:
    """Until the process has ended and its log is read."""
    while True:
        try:
            process.wait(LOOK_S)
            break
        except subprocess.TimeoutExpired:
            watch.look()
        if time.monotonic() - watch.began > limit_s:
            raise Failed(f"`{shlex.join(words)}` did not end within {limit_s:.0f} s and was killed")
    watch.look()


def run(
    words: list[str], folder: Path, env: dict[str, str], log: Path, texts: tuple[str, ...] = (), limit_s: float = LIMIT_S
) -> Run:
    """Runs the command in the folder, with both outputs in the log. Processes that it leaves behind are killed."""
    steps = log.with_suffix(".steps")
    cpu_before, began = cpu_s(), time.monotonic()
    with log.open("wb") as out:
        process = subprocess.Popen(
            words,
            cwd=folder,
            env=env | {"COSTS_STEPS": str(steps)},
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        watch = Watch(log, texts, began)
        try:
            wait(process, watch, words, limit_s)
        finally:
            wall_s = time.monotonic() - began
            kill_group(process)
            process.wait()
            watch.file.close()
    return Run(words, wall_s, cpu_s() - cpu_before, process.returncode, log, watch.moments, read_steps(steps))


def read_steps(file: Path) -> list[Step]:
    if not file.exists():
        return []
    steps = [Step(**json.loads(line)) for line in file.read_text().splitlines()]
    return sorted(steps, key=lambda step: step.began)
