"""Writes endlessly: lines to `stdout` or `stderr`, an `endless` line, or to `both` at once."""
import os
import sys
import threading

kind = sys.argv[2]
LINE = b"x" * 99 + b"\n"


def pour(fd, chunk):
    while True:
        os.write(fd, chunk)


if kind == "endless":
    pour(1, b"x" * 4096)
if kind == "stderr":
    threading.Thread(target=pour, args=(2, LINE * 650), daemon=True).start()
    for line in sys.stdin:
        print(line.strip(), flush=True)
if kind == "both":
    threading.Thread(target=pour, args=(2, LINE * 650), daemon=True).start()
pour(1, LINE)
