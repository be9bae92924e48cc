"""Reports its CPUs, tries to leave them, burns some CPU time in two threads, and reports again."""
import json
import os
import sys
import threading
import time


def spin():
    end = time.process_time() + 0.2
    while time.process_time() < end:
        pass


before = sorted(os.sched_getaffinity(0))
try:
    os.sched_setaffinity(0, range(os.cpu_count()))
    answer = "ok"
except OSError as error:
    answer = error.strerror
threads = [threading.Thread(target=spin) for _ in range(2)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
print(json.dumps({"before": before, "answer": answer, "after": sorted(os.sched_getaffinity(0))}), flush=True)
for line in sys.stdin:
    print(line.strip(), flush=True)
