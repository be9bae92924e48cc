"""Looks for covert channels: effects on shared files that another agent can see (x86-64).

`covert_channel.py MARK FILE` makes each call on FILE, which agents share (`library`: a file of Python), and reports its
error name, its value or `ok`. MARK identifies its processes for the test. With the argument `leave` it then leaves traces
wherever it can. With `hold` it also keeps them and echoes lines.
"""
import ctypes
import errno
import fcntl
import json
import mmap
import os
import signal
import struct
import sys

path = os.__file__ if sys.argv[2] == "library" else sys.argv[2]
# Some notifications are sent as this signal, if they are not refused.
signal.signal(signal.SIGIO, signal.SIG_IGN)
libc = ctypes.CDLL(None, use_errno=True)
libc.syscall.restype = ctypes.c_long
shared = os.open(path, os.O_RDONLY)
size = os.fstat(shared).st_size
# Mapped with the C library, since Python's mmap duplicates the descriptor.
libc.mmap.restype = ctypes.c_void_p
libc.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t] + [ctypes.c_int] * 3 + [ctypes.c_long]
mapped = libc.mmap(None, size, mmap.PROT_READ, mmap.MAP_SHARED, shared, 0)
memory = ctypes.create_string_buffer(1 << 16)
address = ctypes.addressof(memory)
# The buffer and its length, for vectored reads.
iovec = struct.pack("PP", address, 4096)
vector = ctypes.create_string_buffer(iovec, len(iovec))


def call(number, *arguments):
    """Makes the system call with this number."""
    ctypes.set_errno(0)
    result = libc.syscall(ctypes.c_long(number), *(ctypes.c_long(value) for value in arguments))
    return "ok" if result != -1 else errno.errorcode[ctypes.get_errno()]


def control_lock(command, kind=fcntl.F_RDLCK):
    """Makes a command of `fcntl` with a lock of the first byte; `held` if another process has it."""
    lock = struct.pack("hhqqi4x", kind, os.SEEK_SET, 0, 1, 0)
    try:
        answer = fcntl.fcntl(shared, command, lock)
        return "ok" if struct.unpack("hhqqi4x", answer)[0] in (kind, fcntl.F_UNLCK) else "held"
    except OSError as error:
        return errno.errorcode[error.errno]


def control_file(command, argument):
    """Makes a command of `fcntl`, by its number."""
    return call(72, shared, command, argument)


def attempt(action):
    try:
        value = action()
        return "ok" if value is None else value
    except OSError as error:
        return errno.errorcode[error.errno]


def read_vector(flags):
    """`preadv2` with these flags."""
    return call(327, shared, ctypes.addressof(vector), 1, 0, 0, flags)


def forks():
    """Whether the host's count of all started processes changes."""
    before = open("/proc/stat").read()
    child = os.fork()
    if child == 0:
        os._exit(0)
    os.waitpid(child, 0)
    return "same" if open("/proc/stat").read() == before else "counted"


# Numbers without a name are those of the system calls, commands and flags that the keys describe, on x86-64.
calls = {
    "exclusive_lock_of_file": lambda: call(73, shared, fcntl.LOCK_EX | fcntl.LOCK_NB),
    "shared_lock_of_file": lambda: call(73, shared, fcntl.LOCK_SH | fcntl.LOCK_NB),
    "lock": lambda: control_lock(fcntl.F_SETLK),
    "lock_query": lambda: control_lock(fcntl.F_GETLK, fcntl.F_WRLCK),
    "open_file_lock": lambda: control_lock(37),
    "open_file_lock_waiting": lambda: control_lock(38),
    "open_file_lock_query": lambda: control_lock(36, fcntl.F_WRLCK),
    "lease": lambda: control_file(1024, fcntl.F_RDLCK),
    "lease_query": lambda: control_file(1025, 0),
    "directory_notification": lambda: control_file(1026, 1),
    "write_hint": lambda: control_file(1036, address),
    "write_hint_query": lambda: control_file(1035, address),
    "open_file_write_hint": lambda: control_file(1038, address),
    "inotify_init": lambda: call(253),
    "inotify_init1": lambda: call(294, 0),
    "fanotify_init": lambda: call(300, 0, 0),
    "asynchronous_slots": lambda: call(206, 1, address),
    "mincore": lambda: call(27, mapped, size, address),
    "cachestat": lambda: call(451, shared, address, address, 0),
    "read_vector": lambda: read_vector(0),
    "read_if_in_memory": lambda: read_vector(8),
    "read_and_drop": lambda: read_vector(0x80),
    "read_high_priority": lambda: read_vector(1),
    "collapse": lambda: call(28, mapped, size, 25),
    "advice_will_need": lambda: call(221, shared, 0, 0, 3),
    "advice_do_not_need": lambda: call(221, shared, 0, 0, 4),
    "readahead": lambda: call(187, shared, 0, size),
    "mapped_will_need": lambda: call(28, mapped, size, 3),
    "mapped_cold": lambda: call(28, mapped, size, 20),
    "mapped_page_out": lambda: call(28, mapped, size, 21),
    "change_mode": lambda: attempt(lambda: os.chmod(path, 0o600)),
    "change_times": lambda: attempt(lambda: os.utime(path)),
    "extended_attribute": lambda: attempt(lambda: os.setxattr(path, "user.board", b"1")),
    "open_to_write": lambda: attempt(lambda: os.open(path, os.O_RDWR)),
    "new_terminal": lambda: attempt(lambda: os.open("/dev/ptmx", os.O_RDWR)),
    "system_locks": lambda: attempt(lambda: open("/proc/locks").read()),
    "memory_counters": lambda: attempt(lambda: open("/proc/vmstat").read()),
    "host_settings": lambda: attempt(lambda: " ".join(os.listdir("/proc/sys"))),
    "system_forks": forks,
    "keys": lambda: call(250, 0, -3, 1),
    "kcmp": lambda: call(312, os.getpid(), os.getpid(), 0, 0, 0),
    "shared_segments": lambda: attempt(lambda: str(len(open("/proc/sysvipc/shm").readlines()) - 1)),
    "semaphores": lambda: attempt(lambda: str(len(open("/proc/sysvipc/sem").readlines()) - 1)),
    "queues": lambda: attempt(lambda: str(len(open("/proc/sysvipc/msg").readlines()) - 1)),
    "leftover_files": lambda: attempt(lambda: " ".join(os.listdir("/tmp") + os.listdir("/dev/shm"))),
    "leftover_queue": lambda: "gone"
    if libc.mq_open(b"/faceoff-board", os.O_RDONLY) < 0 and ctypes.get_errno() == errno.ENOENT
    else "there",
}
answers = {name: make_call() for name, make_call in calls.items()}
print(json.dumps(answers), flush=True)
if "hold" in sys.argv or "leave" in sys.argv:
    # Leaves kernel objects, files, and a file that was read.
    identifiers = [
        libc.shmget(0x5EED, 4096, 0o1666), libc.semget(0x5EED, 1, 0o1666), libc.msgget(0x5EED, 0o1666),
        libc.mq_open(b"/faceoff-board", os.O_CREAT | os.O_RDONLY, 0o600, None),
        os.open("/tmp/board", os.O_CREAT), os.open("/dev/shm/board", os.O_CREAT),
    ]
    os.pread(shared, size, 0)
    print("held" if min(identifiers) >= 0 else f"only {identifiers}", flush=True)
    for line in sys.stdin if "hold" in sys.argv else ():
        sys.stdout.write(line)
        sys.stdout.flush()
