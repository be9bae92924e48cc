#!/usr/bin/env python3
"""Evaluates an own agent as an ordinary user on hosts that lack something. On each of them `faceoff eval` runs, with one line that names
the missing layers of the sandbox, refuses another team's archive without namespaces, and `faceoff doctor` gives the fix of the cause.

It needs root and debootstrap.
"""

import argparse
import re
from dataclasses import dataclass, field
from pathlib import Path

from first_hour import packages
from machine import PATH, Machine, debian

FOLDER = Path(__file__).parent
NOTE = re.compile(r"^note: your agent runs without these layers .* get here: (.*); `faceoff doctor` says how$", re.MULTILINE)
# The layers that an ordinary user lacks if systemd gives the user no control groups.
CGROUPS = ["cgroup-memory", "cgroup-pids", "cgroup-cpu"]
WITHOUT_NAMESPACES = ["namespaces", *CGROUPS]


def program(path: str, text: str) -> str:
    """Commands of the shell that install a program."""
    return f"cat >{path} <<'END'\n{text}\nEND\nchmod 755 {path}\n"


def failing_bubblewrap(message: str) -> str:
    """A bubblewrap that is installed and prints this message when it starts a sandbox."""
    text = f"""#!/bin/sh
case $1 in --version | --help) exec /usr/bin/bwrap.original "$@" ;; esac
echo 'bwrap: {message}' >&2
exit 1"""
    return "mv /usr/bin/bwrap /usr/bin/bwrap.original\n" + program("/usr/bin/bwrap", text)


OLD_BUBBLEWRAP = """#!/bin/sh
case $1 in
--version) echo 'bubblewrap 0.3.0' ;;
--help) echo '    --unshare-user   Create new user namespace' ;;
*)
    echo "bwrap: Unknown option $1" >&2
    exit 1
    ;;
esac"""
# Forbids namespaces in a user namespace of its own, so that the setting of this machine stays.
WITHOUT_USER_NAMESPACES = """#!/bin/sh
exec unshare --user --map-user=1000 --map-group=1000 --keep-caps sh -c '
    echo 0 >/proc/sys/user/max_user_namespaces && exec setpriv --ambient-caps=-all --inh-caps=-all "$@"' sh "$@" """


@dataclass
class Host:
    """A host that lacks something."""

    name: str
    # Part of what doctor recommends; empty if nothing is wrong.
    fix: str
    # Commands of root that make the host so.
    setup: str = ":"
    # Program through which the user's commands are started.
    through: str = ""
    missing: list[str] = field(default_factory=lambda: CGROUPS)
    path: str = PATH


HOSTS = [
    Host("as this one", "run the service as root"),
    Host(
        "control groups of version 2 only",
        "Delegate=",
        "umount -l /sys/fs/cgroup\nmount -t cgroup2 none /sys/fs/cgroup",
    ),
    Host("no control groups", "mount -t cgroup2", "umount -l /sys/fs/cgroup"),
    Host(
        # The fix depends on whether the user may enter the folder that an earlier server has left.
        "read-only /sys",
        "",
        """awk '$5 ~ "^/sys" { print $5 }' /proc/self/mountinfo | while read -r point; do mount -o remount,bind,ro "$point"; done""",
    ),
    Host(
        "container without privileges",
        "in Docker: docker run --security-opt seccomp=",
        "umount -l /sys/fs/cgroup\n" + program("/usr/local/bin/contained", (FOLDER / "contained.py").read_text()),
        through="contained",
        missing=WITHOUT_NAMESPACES,
    ),
    Host(
        "container with masked files in /proc",
        "systempaths=unconfined",
        "mount --bind /dev/null /proc/interrupts",
        missing=WITHOUT_NAMESPACES,
    ),
    Host(
        "no user namespaces",
        "sysctl -w user.max_user_namespaces",
        program("/usr/local/bin/without-namespaces", WITHOUT_USER_NAMESPACES),
        through="without-namespaces",
        missing=WITHOUT_NAMESPACES,
    ),
    Host("no bubblewrap", "apt-get install bubblewrap", "rm /usr/bin/bwrap", missing=WITHOUT_NAMESPACES),
    Host(
        "bubblewrap elsewhere in PATH",
        "",
        "mkdir -p /opt/bin\nmv /usr/bin/bwrap /opt/bin/",
        path=f"{PATH}:/opt/bin",
    ),
    Host("bubblewrap not executable", "chmod 755 /usr/bin/bwrap", "chmod -x /usr/bin/bwrap", missing=WITHOUT_NAMESPACES),
    Host("old bubblewrap", "install a newer bubblewrap", program("/usr/bin/bwrap", OLD_BUBBLEWRAP), missing=WITHOUT_NAMESPACES),
    Host(
        "bubblewrap restricted by AppArmor",
        "AppArmor",
        failing_bubblewrap("setting up uid map: Permission denied"),
        missing=WITHOUT_NAMESPACES,
    ),
    Host(
        "network of bubblewrap restricted by AppArmor",
        "AppArmor",
        failing_bubblewrap("loopback: Failed RTM_NEWADDR: Operation not permitted"),
        missing=WITHOUT_NAMESPACES,
    ),
]


def problems(host: Host, machine: Machine) -> list[str]:
    """What is wrong on this host, each with the output that shows it."""
    found = []

    def run(command: str):
        return machine.run(f"{host.through} {command}", variables={"PATH": host.path})

    run("faceoff new agent")
    done = run("faceoff eval agent --task defend --episodes 1 --out result")
    if done.returncode != 0 or NOTE.findall(done.stdout) != [", ".join(host.missing)]:
        found.append(f"eval should run and name {host.missing}; exit status {done.returncode}:\n{done.stdout}")
    machine.run("tar czf agent.tar.gz agent")
    done = run("faceoff eval agent.tar.gz --task defend --episodes 1 --out result-of-archive")
    refused = done.returncode == 1 and "cannot get the layer namespaces" in done.stdout
    if refused != ("namespaces" in host.missing):
        found.append(f"eval should refuse an archive only without namespaces; exit status {done.returncode}:\n{done.stdout}")
    advice = run("faceoff doctor").stdout.split("Runtimes", 1)[0]
    if host.fix not in advice:
        found.append(f"doctor should recommend {host.fix!r}:\n{advice}")
    if "apt-get install bubblewrap" in advice and "apt-get install bubblewrap" not in host.fix:
        found.append(f"doctor should not recommend to install bubblewrap:\n{advice}")
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", required=True, type=Path, help="the built faceoff")
    parser.add_argument("--cache", required=True, type=Path, help="folder for Debian's files, which are kept")
    parser.add_argument("--suite", default="bookworm", help="Debian's version")
    options = parser.parse_args()
    root = debian(options.suite, packages(), options.cache.resolve())
    failed = 0
    for host in HOSTS:
        with Machine(root, options.program.resolve(), setup=host.setup) as machine:
            found = problems(host, machine)
        print(f"{'FAILED' if found else 'ok    '} {host.name}", *found, sep="\n", flush=True)
        failed += bool(found)
    if failed:
        raise SystemExit(f"{failed} of {len(HOSTS)} hosts failed")


if __name__ == "__main__":
    main()
