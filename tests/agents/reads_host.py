"""Tries to read files of the host: reads_host.py MARK PATH…, with files and folders that must stay hidden. MARK identifies its
processes for the test.

Reports one JSON object: the files that could be read, what is visible, and the rights of the process.
"""
import json
import os
import sys


def attempt(action):
    try:
        return action()
    except OSError as error:
        return None if error.errno else str(error)


def read(path):
    with open(path, "rb") as file:
        return file.read(4096).decode("latin-1")


hidden = sys.argv[2:] + [
    "/etc/shadow", "/etc/ssl", "/etc/machine-id", "/root", "/home", "/var/lib", "/run",
    "/sys/kernel", "/srv", "/boot", "/proc/1/root/etc/shadow", "/proc/1/cwd/../../etc/shadow",
    "/proc/kcore", "/dev/mem", "/dev/kmsg", "/dev/vda", "/dev/sda", "/dev/fuse", "/dev/kvm",
]
# The hidden files that could be read all the same.
reached = []
for path in hidden:
    found = attempt(lambda: os.listdir(path)) if os.path.isdir(path) else attempt(lambda: read(path))
    if found:
        reached.append(path)

processes = [entry for entry in os.listdir("/proc") if entry.isdigit()]
status = dict(line.split(":", 1) for line in read("/proc/self/status").splitlines() if ":" in line)
print(json.dumps({
    "init": os.listdir("/proc/1"),
    "reached": reached,
    # Names only: if the sandbox leaks values, the test's log must not show them.
    "environment": sorted(os.environ),
    "environs": sorted({
        variable.split("=")[0]
        for pid in processes
        for variable in (attempt(lambda: read(f"/proc/{pid}/environ")) or "").split("\0") if variable
    }),
    "processes": processes,
    "root": sorted(os.listdir("/")),
    "etc": sorted(os.listdir("/etc")) if os.path.isdir("/etc") else [],
    "passwd": attempt(lambda: read("/etc/passwd")),
    "descriptors": [os.readlink(f"/proc/self/fd/{fd}") for fd in ("0", "1", "2")],
    "other_descriptors": [
        f"{fd} {os.readlink(f'/proc/self/fd/{fd}')}" for fd in range(3, 1024) if attempt(lambda: os.fstat(fd))
    ],
    "uid": os.getuid(),
    "groups": os.getgroups(),
    "directory": os.getcwd(),
    "bundle": sorted(os.listdir(".")),
    "terminal": attempt(lambda: os.open("/dev/tty", os.O_RDWR)),
    "session_is_own": os.getsid(0) in (0, 1),
    "cpus": sorted(os.sched_getaffinity(0)),
    "status": {name: value.strip() for name, value in status.items()},
}), flush=True)
