#!/usr/bin/env python3
"""Runs the first hour of docs/start.md as an ordinary user in a fresh Debian, with the commands of the page.

The root file system is made by debootstrap with what the guide asks for, and kept below --cache. Root is needed to make it and to enter
it; the commands run as a user without privileges. What the guide shows must appear, except times, ids and results of the validation.

usage: first_hour.py --program FACEOFF --cache FOLDER [--suite bookworm]
"""

import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
GUIDE = REPOSITORY / "docs/start.md"
SECTION = "## First hour: an agent on the board"
# What the guide tells a team to have, beside the program.
PACKAGES = "python3,bubblewrap"
MIRROR = "http://deb.debian.org/debian"
USER = 1000
HOME = "/home/ada"
# A line that begins so separates the outputs of the commands.
MARK = "@@@ "

# Parts of shown lines that differ from run to run. Penalty points and tiers depend on how busy the machine is.
VARIABLE = [
    r" \d+\.\d +(Deployable|Improvable|Non-deployable).*",
    r", penalty points .*",
    r"\d+\.\d+ ?/ ?\d+\.\d+ ?/ ?\d+\.\d+",  # times: mean, 99 %, longest
    r"\d+(\.\d+)? m?s\b",
    r"\d+\.\d+s\b",
    r"[0-9a-f]{8}-[0-9a-f-]{27}",
    r"\d{4}-\d{2}-\d{2}( at)?",
    r"https?://[\w.:]+",
    r"\s+",
]
# Shown lines that depend on the seeds of the server: the episodes of the validation.
OF_SERVER = re.compile(r"^(hit|defend|prepare) +\d+ answers|violated limits? in|^…$|^it is active|^OK$|^Ran ")

# Enters the root file system and becomes the user. bubblewrap makes user namespaces, which Linux forbids below chroot.
ENTER = r"""
set -e
root=$1 program=$2 script=$3
mount --bind "$root" "$root"
for folder in proc dev sys tmp home/ada old; do mkdir -p "$root/$folder"; done
mount -t tmpfs -o mode=755,uid={user},gid={user} none "$root{home}"
mount -t tmpfs -o mode=1777 none "$root/tmp"
install -m 755 "$program" "$root/tmp/faceoff"
install -m 644 "$script" "$root/tmp/commands.sh"
mount --rbind /dev "$root/dev"
mount --rbind /sys "$root/sys"
cd "$root"
pivot_root . old
mount -t proc proc /proc
umount -l /old
mkdir /tmp/bin && mv /tmp/faceoff /tmp/bin
cd {home}
exec setpriv --reuid {user} --regid {user} --clear-groups --no-new-privs env -i HOME={home} LANG=C.UTF-8 \
    PATH=/tmp/bin:/usr/local/bin:/usr/bin:/bin bash /tmp/commands.sh
""".format(user=USER, home=HOME)


def make_root(suite: str, cache: pathlib.Path) -> pathlib.Path:
    """The root file system of a Debian release; made once."""
    root = cache / f"{suite}-root"
    if not (root / ".complete").exists():
        subprocess.run(["rm", "-rf", root], check=True)
        cache.mkdir(parents=True, exist_ok=True)
        command = ["debootstrap", "--variant=minbase", f"--include={PACKAGES}", suite, root, MIRROR]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        (root / ".complete").touch()
    return root


def guide_commands() -> list[tuple[str, list[str]]]:
    """The commands of the section, each with the lines that the guide shows after it."""
    section = GUIDE.read_text().split(SECTION, 1)[1].split("\n## ", 1)[0]
    commands: list[tuple[str, list[str]]] = []
    for block in re.findall(r"```console\n(.*?)```", section, re.DOTALL):
        for line in block.splitlines():
            if line.startswith("$ "):
                commands.append((line[2:].split("   #")[0].strip(), []))
            elif line.strip():
                commands[-1][1].append(line)
    if not commands:
        sys.exit(f"{GUIDE} has no commands in the section {SECTION!r}")
    return commands


def plain(line: str) -> str:
    for pattern in VARIABLE:
        line = re.sub(pattern, " ", line)
    return line.strip()


class Server:
    """A server outside of the root file system, on the loopback address."""

    def __init__(self, program: str, folder: str) -> None:
        self.program, self.data = program, f"{folder}/data"
        config = pathlib.Path(folder, "faceoff.toml")
        config.write_text("[evaluation]\nepisodes_per_task = 20\n")
        command = [program, "serve", "--config", str(config), "--data-dir", self.data, "--listen", "127.0.0.1:0"]
        self.log = open(f"{folder}/log", "w+")
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=self.log, text=True)
        self.url = self.process.stdout.readline().strip()
        if not self.url.startswith("http"):
            self.log.seek(0)
            sys.exit(f"the server did not start: {self.log.read()}")

    def invitation(self) -> str:
        command = [self.program, "admin", "people", "invite-team", "Ada", "--server", self.url, "--data-dir", self.data]
        output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        return re.search(r"\S+/join/\S+", output).group()

    def stop(self) -> None:
        self.process.terminate()
        self.process.wait(timeout=60)


def run(root: pathlib.Path, program: str, script: pathlib.Path) -> subprocess.CompletedProcess:
    command = ["unshare", "--mount", "--pid", "--fork", "--kill-child", "sh", "-c", ENTER, "sh", root, program, script]
    return subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=1200)


def check(commands: list[tuple[str, list[str]]], outputs: list[str]) -> None:
    for (command, shown), output in zip(commands, outputs):
        lines = [plain(line) for line in output.splitlines()]
        for line in shown:
            if not OF_SERVER.search(line.strip()) and plain(line) not in lines:
                sys.exit(f"$ {command}\n{output}\nThe guide shows a line that is not there:\n{line}")
        print(f"ok  $ {command}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", required=True)
    parser.add_argument("--cache", required=True, type=pathlib.Path)
    parser.add_argument("--suite", default="bookworm")
    options = parser.parse_args()
    program = os.path.abspath(options.program)
    root = make_root(options.suite, options.cache.resolve())
    commands = guide_commands()
    with tempfile.TemporaryDirectory() as folder:
        server = Server(program, folder)
        try:
            link = server.invitation()
            script = pathlib.Path(folder, "commands.sh")
            lines = ["set -eo pipefail", "exec 2>&1"]
            for number, (command, _) in enumerate(commands):
                lines += [f"echo '{MARK}{number}'", command.replace("LINK", f"'{link}'")]
            script.write_text("\n".join([*lines, f"echo '{MARK}end'", ""]))
            done = run(root, program, script)
        finally:
            server.stop()
    outputs = re.split(rf"^{MARK}(?:\d+|end)\n", done.stdout, flags=re.MULTILINE)[1:]
    if done.returncode != 0:
        failed = commands[max(len(outputs), 1) - 1][0]
        sys.exit(f"$ {failed}\n{outputs[-1] if outputs else done.stdout}{done.stderr}exit status {done.returncode}")
    check(commands, outputs)
    print(f"the first hour of {GUIDE.name} works in a fresh Debian {options.suite}")


if __name__ == "__main__":
    main()
