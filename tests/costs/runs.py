"""Runs a command and records its time, its CPU time and the times of lines in its log."""

import json
import os
import resource
import shlex
import signal
import subprocess
import time
from dataclasses import dataclass, field
from pathlib import Path

# Time limit of a command: longer than any measured command takes, also on a slow machine.
LIMIT_S = 4 * 3600
# Interval at which the log is read: the precision of all times.
POLL_S = 0.1
# Lines of a failed command's log that are shown.
LAST_LINES = 30


class Failed(Exception):
    """A failed measurement, with a message for the user."""


@dataclass(frozen=True)
class Step:
    """A line of a make recipe."""

    target: str
    line: str
    # Seconds since 1970.
    began: float
    wall_s: float
    cpu_s: float
    status: int


@dataclass(frozen=True)
class Run:
    command: list[str]
    # Wall-clock and CPU seconds of the process and its descendants.
    wall_s: float
    cpu_s: float
    status: int
    log: Path
    # Seconds from the start until a line of the log began with this text.
    line_times: dict[str, float] = field(default_factory=dict)
    steps: list[Step] = field(default_factory=list)

    def failure(self) -> str:
        lines = self.log.read_text(errors="replace").splitlines()[-LAST_LINES:]
        return (
            f"`{shlex.join(self.command)}` ended with status {self.status}; the whole log is {self.log}, "
            f"which ends with:\n" + "\n".join(f"    {line}" for line in lines)
        )

    def require_success(self) -> "Run":
        if self.status != 0:
            raise Failed(self.failure())
        return self


class LogReader:
    """Follows a log, and records when lines appear that begin with one of the texts."""

    def __init__(self, log: Path, texts: tuple[str, ...], began: float):
        self.file, self.texts, self.began = log.open("rb"), texts, began
        self.unread = b""
        self.line_times: dict[str, float] = {}

    def read_new_lines(self) -> None:
        now = time.monotonic() - self.began
        *lines, self.unread = (self.unread + self.file.read()).split(b"\n")
        for line in lines:
            for text in self.texts:
                if line.startswith(text.encode()):
                    self.line_times.setdefault(text, now)


def cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def kill_group(process: subprocess.Popen[bytes]) -> None:
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass


def wait(process: subprocess.Popen[bytes], reader: LogReader, command: list[str], limit_s: float) -> None:
    """Waits until the process has ended, and reads its log to the end."""
    while True:
        try:
            process.wait(POLL_S)
            break
        except subprocess.TimeoutExpired:
            reader.read_new_lines()
        if time.monotonic() - reader.began > limit_s:
            raise Failed(f"`{shlex.join(command)}` did not end within {limit_s:.0f} s and was killed")
    reader.read_new_lines()


def run(
    command: list[str], folder: Path, env: dict[str, str], log: Path, texts: tuple[str, ...] = (), limit_s: float = LIMIT_S
) -> Run:
    """Runs the command in the folder, with both outputs in the log. Kills processes that it leaves behind."""
    steps = log.with_suffix(".steps")
    cpu_before, began = cpu_s(), time.monotonic()
    with log.open("wb") as out:
        process = subprocess.Popen(
            command,
            cwd=folder,
            env=env | {"COSTS_STEPS": str(steps)},
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        reader = LogReader(log, texts, began)
        try:
            wait(process, reader, command, limit_s)
        finally:
            wall_s = time.monotonic() - began
            kill_group(process)
            process.wait()
            reader.file.close()
    return Run(command, wall_s, cpu_s() - cpu_before, process.returncode, log, reader.line_times, read_steps(steps))


def read_steps(file: Path) -> list[Step]:
    if not file.exists():
        return []
    steps = [Step(**json.loads(line)) for line in file.read_text().splitlines()]
    return sorted(steps, key=lambda step: step.began)
