"""Reports the number of CPUs by each way in which an agent can count them."""
import json
import os


def listed_cpus(name):
    with open(f"/sys/devices/system/cpu/{name}") as file:
        parts = [part.split("-") for part in file.read().strip().split(",")]
    return [cpu for part in parts for cpu in range(int(part[0]), int(part[-1]) + 1)]


with open("/proc/cpuinfo") as file:
    cpuinfo = [int(line.split(":")[1]) for line in file if line.startswith("processor")]
with open("/proc/stat") as file:
    words = [line.split()[0] for line in file]
print(json.dumps({
    "count": os.cpu_count(),
    "configured": os.sysconf("SC_NPROCESSORS_CONF"),
    "affinity": sorted(os.sched_getaffinity(0)),
    "online": listed_cpus("online"),
    "possible": listed_cpus("possible"),
    "present": listed_cpus("present"),
    "cpuinfo": cpuinfo,
    "stat": [int(word[3:]) for word in words if word[:3] == "cpu" and word != "cpu"],
    "system": sorted(os.listdir("/sys/devices/system/cpu")),
    "threads": sorted({value for name, value in os.environ.items() if name.endswith("_NUM_THREADS")}),
}), flush=True)
