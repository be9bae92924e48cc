"""Tries to reopen its standard input and output by each of their names in `/proc`, in this process and in a child. Also
tries to shrink the input and to enlarge the buffers of its output and its log. Reports each error's name, or `ok`.
"""
import errno
import fcntl
import json
import os
import socket
import stat
import threading

# The command of `fcntl` that sets the size of a pipe.
F_SETPIPE_SZ = 1031


def attempt(action):
    try:
        action()
        return "ok"
    except OSError as error:
        return errno.errorcode[error.errno]


def names(process, threads):
    yield from (f"/proc/{process}/fd/{fd}" for fd in (0, 1))
    yield from (f"/proc/{process}/task/{thread}/fd/{fd}" for thread in threads for fd in (0, 1))


def try_all_modes(label, process):
    threads = os.listdir(f"/proc/{process}/task")
    for name in names(process, threads):
        for mode, flags in (("read", os.O_RDONLY), ("write", os.O_WRONLY), ("both", os.O_RDWR)):
            found[f"{label} {name} {mode}"] = attempt(lambda: os.open(name, flags | os.O_NONBLOCK))


# What each attempt led to.
found = {}
stop = threading.Event()
other = threading.Thread(target=stop.wait)
other.start()
try_all_modes("own", "self")
try_all_modes("own", os.getpid())
for name in ("/dev/stdin", "/dev/stdout", "/dev/fd/0", "/dev/fd/1", "/proc/thread-self/fd/0"):
    found[name] = attempt(lambda: os.open(name, os.O_RDWR | os.O_NONBLOCK))
read_end, write_end = os.pipe()
child = os.fork()
if child == 0:
    os.close(write_end)
    os.read(read_end, 1)
    os._exit(0)
try_all_modes("child", child)
os.close(write_end)
os.waitpid(child, 0)
# Sockets may have any mode, so only that of a pipe is reported.
mode_change = attempt(lambda: os.fchmod(0, 0o666))
if stat.S_ISFIFO(os.fstat(0).st_mode):
    found["shrink mode"] = mode_change
copy = os.dup(0)
for label, fd in (("input", 0), ("output", 1), ("copy", copy)):
    found[f"shrink {label}"] = attempt(lambda: fcntl.fcntl(fd, F_SETPIPE_SZ, 4096))
found["shrink log"] = attempt(lambda: fcntl.fcntl(2, F_SETPIPE_SZ, 1 << 20))
with socket.socket(fileno=os.dup(1)) as output:
    before = output.getsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF)
    found["send_buffer"] = attempt(lambda: output.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4 * before))
    if output.getsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF) == before:
        found["send_buffer"] = "stays"
stop.set()
other.join()
print(json.dumps(found), flush=True)
