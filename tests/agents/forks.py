"""Forks: forks.py MARK KIND. MARK identifies its processes for the test. `count`: until refused, then reports the number of children.
`exit`: the same, then exits. `bomb`: endlessly, in each child."""
import os
import sys
import time

if sys.argv[2] == "bomb":
    # The test waits for this line.
    print("lit", flush=True)
    while True:
        try:
            os.fork()
        except OSError:
            pass

children = 0
while True:
    try:
        if os.fork() == 0:
            time.sleep(3600)
    except OSError as error:
        print(children, error.strerror, flush=True)
        break
    children += 1
if sys.argv[2] == "exit":
    sys.exit(7)
for line in sys.stdin:
    print(line.strip(), flush=True)
