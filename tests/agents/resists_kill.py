"""Tries to survive a kill: resists_kill.py MARK KIND. MARK identifies its processes for the test. It resets its parent-death
signal and ignores signals. Kinds: `ignores` also ignores a closed input, `daemon` leaves a grandchild in a new session and
exits, `daemon-stays` leaves one and stays, `group` has many children."""
import ctypes
import os
import signal
import sys
import time


def daemon():
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            for fd in range(3):
                os.close(fd)
            time.sleep(3600)
        os._exit(0)
    os.wait()


for number in set(signal.Signals) - {signal.SIGKILL, signal.SIGSTOP}:
    try:
        signal.signal(number, signal.SIG_IGN)
    except OSError:
        pass
signal.signal(signal.SIGCHLD, signal.SIG_DFL)

# Resets the signal at the parent's death (PR_SET_PDEATHSIG).
ctypes.CDLL(None).prctl(1, 0)

kind = sys.argv[2]
if kind.startswith("daemon"):
    daemon()
if kind == "group":
    for _ in range(20):
        if os.fork() == 0:
            while True:
                time.sleep(3600)
print("ready", flush=True)
if kind == "daemon":
    sys.exit(0)
while True:
    time.sleep(3600)
