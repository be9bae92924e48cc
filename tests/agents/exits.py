"""Ends in the way that KIND names, after one answer: exits.py MARK KIND [STATUS]. MARK identifies its processes for the test."""
import os
import signal
import sys

print("ready", flush=True)
kind = sys.argv[2]
if kind == "exit":
    sys.exit(int(sys.argv[3]))
if kind == "crash":
    print("about to crash", file=sys.stderr)
    raise RuntimeError("crashed on purpose")
if kind == "abort":
    os.abort()
if kind == "segfault":
    import ctypes
    ctypes.string_at(1)
if kind == "close":
    os.close(1)
    signal.pause()
if kind == "close-input":
    os.close(0)
    print("closed", flush=True)
    signal.pause()
if kind == "half":
    # Half of an answer.
    os.write(1, b'{"type":"act","step"')
    os._exit(3)
if kind == "silent":
    signal.pause()
if kind == "deaf":
    # Never reads its input.
    signal.pause()
