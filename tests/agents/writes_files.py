"""Tries to write to many folders and files: writes_files.py MARK FOLDER…. MARK identifies its processes for the test. Reports where it
could create (`took`) or change (`changed`) something."""
import json
import os
import sys

places = sys.argv[2:] + [
    "/", "/agent", "/usr", "/usr/lib", "/lib", "/etc", "/dev", "/proc", "/proc/sys/kernel", "/sys", "/var",
    "/run", "/home", "/root", "/tmp", "/dev/shm",
]
# Places in which a new file could be created.
took = []
for place in places:
    name = os.path.join(place, "written-by-agent")
    for action in (
        lambda: open(name, "w").write("x"),
        lambda: os.mkdir(name + ".d"),
        lambda: os.symlink("/etc/shadow", name + ".l"),
        lambda: os.link(os.path.join(place, os.listdir(place)[0]), name + ".h"),
        lambda: os.mkfifo(name + ".f"),
    ):
        try:
            action()
            took.append(place)
        except (OSError, IndexError):
            pass

# Existing files and folders that could be changed.
changed = []
for file in ("/agent/" + os.path.basename(__file__), "/etc/passwd", "/proc/sys/kernel/core_pattern",
             "/proc/sysrq-trigger", "/proc/sys/vm/overcommit_memory"):
    for action in (
        lambda: os.close(os.open(file, os.O_WRONLY)),
        lambda: os.chmod(file, 0o777),
        lambda: os.unlink(file),
        lambda: os.rename(file, file + ".moved"),
    ):
        try:
            action()
            changed.append(file)
        except OSError:
            pass
print(json.dumps({"took": sorted(set(took)), "changed": changed}), flush=True)
