"""Writes without end, as KIND says: lines to `stdout` or `stderr`, an `endless` line, or lines to `both` outputs. Usage: floods.py MARK
KIND; MARK identifies its processes for the test."""
import os
import sys
import threading

kind = sys.argv[2]
LINE = b"x" * 99 + b"\n"
# 65,000 bytes at once, almost as much as the log keeps.
BLOCK = LINE * 650


def write_endlessly(fd, chunk):
    while True:
        os.write(fd, chunk)


if kind == "endless":
    write_endlessly(1, b"x" * 4096)
if kind == "stderr":
    threading.Thread(target=write_endlessly, args=(2, BLOCK), daemon=True).start()
    for line in sys.stdin:
        print(line.strip(), flush=True)
if kind == "both":
    threading.Thread(target=write_endlessly, args=(2, BLOCK), daemon=True).start()
write_endlessly(1, LINE)
