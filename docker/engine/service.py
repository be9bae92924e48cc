#!/usr/bin/env python3
"""Prints a service of docker/compose.yaml as arguments of `docker run`, one per line; replaces the Compose program.

usage: service.py SERVICE CONFIGS [ADDITION]      (CONFIGS: a folder for the files that Compose would mount; ADDITION: a file that is
                                                   appended to them)

Unknown keys are refused, so that no setting is ignored silently. Ports and dependencies are left out on purpose: the test is inside the
network and starts the services in order.
"""

import os
import pathlib
import re
import sys

import yaml

compose = yaml.safe_load((pathlib.Path(__file__).parent.parent / "compose.yaml").read_text())
name, configs, *additions = sys.argv[1], *map(pathlib.Path, sys.argv[2:])
service = compose["services"][name]


def volume(value):
    """A volume of the service as options of `docker run`; it must be defined in the file."""
    if value.split(":")[0] not in compose["volumes"]:
        sys.exit(f"error: {name} has the volume {value}, which the file does not define")
    return ["--volume", value]


def seconds(value):
    """The number of a duration such as `30s`."""
    return str(int(value.removesuffix("s")))


def config(value):
    """A configuration file of the service as options of `docker run`: Compose would mount it, too."""
    return ["--volume", f"{configs / value['source']}:{value['target']}:ro"]


def variables(value):
    """Substitutes environment variables like Compose."""
    return re.sub(r"\$\{(\w+):-([^}]*)\}", lambda found: os.environ.get(found[1]) or found[2], value)


def network(value):
    """The internal network of the service."""
    return ["--network", next(entry for entry in value if compose["networks"][entry].get("internal")), "--network-alias", name]


# From each known key's value to the options of `docker run`.
CONVERTERS = {
    "privileged": lambda value: ["--privileged"] if value else [],
    "cgroup": lambda value: ["--cgroupns", value],
    "restart": lambda value: ["--restart", value],
    "stop_grace_period": lambda value: ["--stop-timeout", seconds(value)],
    "shm_size": lambda value: ["--shm-size", value],
    "environment": lambda value: [word for key in value for word in ("--env", f"{key}={value[key]}")],
    "configs": lambda value: [word for entry in value for word in config(entry)],
    "volumes": lambda value: [word for entry in value for word in volume(entry)],
    "hostname": lambda value: ["--hostname", value],
    "networks": network,
    "cpuset": lambda value: ["--cpuset-cpus", variables(value)],
}
# Keys without an effect in the test, whose services are started in order and reached from inside the network.
LEFT_OUT = {"ports", "depends_on"}
# Keys that are used for the image and its command, below.
IMAGE = {"build", "image", "command"}

options = [word for key in service if key not in LEFT_OUT | IMAGE for word in CONVERTERS[key](service[key])]
configs.mkdir(exist_ok=True)
for entry in service.get("configs", []):
    texts = [compose["configs"][entry["source"]]["content"], *(file.read_text() for file in additions)]
    (configs / entry["source"]).write_text("".join(texts))
image = {"server": "faceoff", "worker": "faceoff-worker"}[service["build"]["target"]] if "build" in service else service["image"]
print("\n".join(["--name", name, *options, image, *service.get("command", [])]))
