"""Answers every line with the same line: the well-behaved agent of the sandbox tests."""
import sys

for line in sys.stdin:
    sys.stdout.write(line)
    sys.stdout.flush()
