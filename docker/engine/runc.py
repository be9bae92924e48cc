#!/usr/bin/python3
"""Wraps runc: removes capabilities that this host does not have from containers and their processes (see start.sh)."""

import json
import os
import subprocess
import sys


def argument_after(word):
    """The argument of this program that follows `word`."""
    return sys.argv[sys.argv.index(word) + 1]


def available_capabilities():
    """The names of the capabilities that this process may have."""
    with open("/proc/self/status") as text:
        bounding = next(line.split()[1] for line in text if line.startswith("CapBnd:"))
    decoded = subprocess.run(["capsh", "--decode=" + bounding], capture_output=True, text=True, check=True).stdout
    return {name.upper() for name in decoded.strip().partition("=")[2].split(",")}


# The JSON file with the capabilities of a new container, or of a program that is started in one; None for other commands.
file = None
if "create" in sys.argv:
    file = os.path.join(argument_after("--bundle"), "config.json")
elif "exec" in sys.argv:
    file = argument_after("--process")
if file:
    with open(file) as text:
        config = json.load(text)
    sets = config.get("process", config).get("capabilities", {})
    available = available_capabilities()
    for kind, names in sets.items():
        sets[kind] = [name for name in names if name in available]
    with open(file, "w") as text:
        json.dump(config, text)
os.execvp("runc", ["runc", *sys.argv[1:]])
