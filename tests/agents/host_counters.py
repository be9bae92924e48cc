"""Reads everything that could show a counter of the host, and moves such counters (x86-64).

`host_counters.py MARK` answers each line of its input with a line of JSON. The line `read` reports what the agent sees: by name a value,
or the error of the call. The line `move` makes and drops objects of all kinds, and takes what can be taken; it reports the number of
steps. The line `session` starts a session and reports its number; `user` reports the host's number of the agent's user; `end` releases
everything. The lines `signal NAME` and `observe NAME` use one of the channels that remain.
"""
import ctypes
import errno
import fcntl
import hashlib
import json
import mmap
import os
import socket
import struct
import sys
import threading
import time

libc = ctypes.CDLL(None, use_errno=True)
libc.syscall.restype = ctypes.c_long
memory = ctypes.create_string_buffer(4096)
address = ctypes.addressof(memory)
DEVICES = ("/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom")
# What another agent could hold while this one looks.
held = []


def attempt(action):
    try:
        value = action()
        return "ok" if value is None else value
    except OSError as error:
        return errno.errorcode[error.errno]


def call(number, *arguments):
    """Makes the system call with this number; its result, or its error."""
    ctypes.set_errno(0)
    memory[:] = bytes(len(memory))
    result = libc.syscall(ctypes.c_long(number), *(ctypes.c_long(value) for value in arguments))
    return result if result != -1 else errno.errorcode[ctypes.get_errno()]


def filled(number, *arguments):
    """The result of a system call that fills `memory`, and what it has written."""
    return [call(number, *arguments), memory.raw.rstrip(b"\0").hex()]


def content(path):
    with open(path, "rb") as file:
        return hashlib.sha256(file.read()).hexdigest()


def tree(folder):
    """Files below a folder, without those of processes."""
    found = {}
    for name in sorted(os.listdir(folder)):
        path = os.path.join(folder, name)
        if name.isdigit() or name in ("self", "thread-self", "net", "mounts") or os.path.islink(path):
            continue
        if os.path.isdir(path):
            found.update(tree(path))
        else:
            found[path] = attempt(lambda path=path: content(path))
    return found


def files_of(folder):
    """Numbers, sizes and modification times of the files below a folder."""
    found = []
    for parent, folders, names in os.walk(folder):
        for name in [".", *folders, *names]:
            status = os.lstat(os.path.join(parent, name))
            found.append([name, status.st_ino, status.st_size, status.st_mtime_ns, status.st_uid, status.st_nlink])
    return found


def lock(path):
    """Locks a device, and releases it."""
    file = os.open(path, os.O_RDWR)
    request = struct.pack("hhqqi4x", fcntl.F_WRLCK, os.SEEK_SET, 0, 1, 0)
    try:
        fcntl.fcntl(file, fcntl.F_SETLK, request)
    finally:
        os.close(file)


def new_process_with_descriptor():
    """`clone` with `CLONE_PIDFD`."""
    result = call(56, 0x1000 | 17, 0, address, 0, 0)
    if result == 0:
        os._exit(0)
    if isinstance(result, int):
        os.waitpid(result, 0)
    return result


one, two = socket.socketpair()
SOL_SOCKET = 1
# Numbers are those of system calls, options and requests on x86-64, which the names describe.
readings = {
    **{f"statfs {path}": lambda path=path: filled(137, ctypes.addressof(ctypes.create_string_buffer(path.encode())), address)
       for path in ("/", "/agent", "/tmp", "/dev", "/dev/shm", "/proc", "/usr/lib", os.path.dirname(os.__file__))},
    "fstatfs": lambda: filled(138, os.open("/agent", os.O_RDONLY), address),
    "sysinfo": lambda: filled(99, address),
    "physical_pages": lambda: os.sysconf("SC_PHYS_PAGES"),
    "free_pages": lambda: os.sysconf("SC_AVPHYS_PAGES"),
    "ustat": lambda: filled(136, os.stat("/agent").st_dev, address),
    "bundle": lambda: files_of("/agent"),
    "system_files": lambda: tree("/proc"),
    "network_files": lambda: {name: attempt(lambda name=name: content(f"/proc/self/net/{name}"))
                              for name in sorted(os.listdir("/proc/self/net"))},
    **{f"lock {device}": lambda device=device: lock(device) for device in DEVICES},
    "socket_cookie": lambda: socket.socketpair()[0].getsockopt(SOL_SOCKET, 57, 8).hex(),
    "network_cookie": lambda: one.getsockopt(SOL_SOCKET, 71, 8).hex(),
    "process_of_peer": lambda: one.getsockopt(SOL_SOCKET, 77, 4).hex(),
    "pass_processes": lambda: one.setsockopt(SOL_SOCKET, 76, 1),
    "memfd_create": lambda: os.fstat(os.memfd_create("x")).st_ino,
    "memfd_secret": lambda: call(447, 0),
    "pidfd_open": lambda: os.fstat(os.pidfd_open(os.getpid())).st_ino,
    "clone_pidfd": new_process_with_descriptor,
    "statx": lambda: filled(332, -100, ctypes.addressof(ctypes.create_string_buffer(b"/agent")), 0, 0xFFF | 0x5000, address),
    "statmount": lambda: filled(457, address, address, 512, 0),
    "listmount": lambda: filled(458, address, address, 512, 0),
    "file_handle": lambda: filled(303, -100, ctypes.addressof(ctypes.create_string_buffer(b"/agent")), address, address + 512, 0),
    **{f"namespace_request {number}": lambda number=number: filled(16, os.open("/proc/self/ns/mnt", os.O_RDONLY), 0xB700 | number, address)
       for number in (1, 2, 3, 4)},
    "namespace_number": lambda: filled(16, os.open("/proc/self/ns/mnt", os.O_RDONLY), 0x8008B70D, address),
    "mount_namespace_number": lambda: filled(16, os.open("/proc/self/ns/mnt", os.O_RDONLY), 0x8008B705, address),
    "place_on_disk": lambda: filled(16, os.open(os.__file__, os.O_RDONLY), 0xC020660B, address),
    "xfs_counts": lambda: filled(16, os.open(os.__file__, os.O_RDONLY), 0x80205871, address),
    "btrfs_space": lambda: filled(16, os.open(os.__file__, os.O_RDONLY), 0xC0109414, address),
    "named_socket": lambda: socket.socket(socket.AF_UNIX).bind(""),
    "entropy": lambda: filled(16, os.open("/dev/random", os.O_RDONLY), 0x80045200, address),
    "mergeable": lambda: call(28, address & ~4095, 4096, 12),
    "merge_all": lambda: call(157, 67, 1, 0, 0, 0),
    "asynchronous_slots": lambda: call(206, 1, address),
    "terminals": lambda: attempt(lambda: os.listdir("/dev/pts")),
    "open_terminal": lambda: os.open("/dev/ptmx", os.O_RDWR),
    "shared_segments": lambda: len(open("/proc/sysvipc/shm").readlines()),
}


def read():
    found = {}
    for name, reading in readings.items():
        found[name] = attempt(reading)
    # Descriptors that readings have opened.
    os.closerange(max(one.fileno(), two.fileno()) + 1, 256)
    return found


def hold_lock(path):
    file = os.open(path, os.O_RDWR)
    fcntl.fcntl(file, fcntl.F_SETLK, struct.pack("hhqqi4x", fcntl.F_WRLCK, os.SEEK_SET, 0, 1, 0))
    held.append(file)


def move():
    """Moves whatever can be moved, and holds what can be held."""
    steps = 0
    for action in (
        lambda: os.pipe(), lambda: socket.socketpair(), lambda: socket.socket(socket.AF_UNIX),
        lambda: mmap.mmap(-1, 1 << 16), lambda: os.memfd_create("x"), lambda: os.pidfd_open(os.getpid()),
        lambda: os.open("/tmp", os.O_TMPFILE | os.O_RDWR), lambda: bytearray(1 << 20),
        *(lambda device=device: hold_lock(device) for device in DEVICES),
    ):
        for _ in range(8):
            try:
                held.append(action())
                steps += 1
            except OSError:
                break
    for _ in range(4):
        waiting = threading.Event()
        thread = threading.Thread(target=waiting.wait, daemon=True)
        thread.start()
        held.append((thread, waiting))
        child = os.fork()
        if child == 0:
            os._exit(0)
        os.waitpid(child, 0)
        steps += 2
    return steps


def release():
    for thing in held:
        if isinstance(thing, int):
            os.close(thing)
        elif isinstance(thing, tuple) and thing[0] == "page":
            libc.munmap(ctypes.c_void_p(thing[1]), 4096)
        elif isinstance(thing, tuple) and isinstance(thing[0], int):
            [os.close(file) for file in thing]
        elif isinstance(thing, tuple) and isinstance(thing[0], threading.Thread):
            thing[1].set()
            thing[0].join()
    held.clear()


def session():
    """Starts a session in a process of its own; the number of its scheduling group, or the error."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.write(writer, str(attempt(lambda: os.setsid() and None or open("/proc/self/autogroup").read())).encode())
        os._exit(0)
    os.waitpid(child, 0)
    answer = os.read(reader, 4096).decode()
    os.close(reader), os.close(writer)
    return answer.split()[0].removeprefix("/autogroup-")


def user():
    options = [option for line in open("/proc/self/mountinfo") for option in line.split()[-1].split(",")]
    return [option.removeprefix("uid=") for option in options if option.startswith("uid=")][0]


def file_number():
    """The inode number of a new pipe."""
    reader, writer = os.pipe()
    number = os.fstat(reader).st_ino
    os.close(reader), os.close(writer)
    return number


def skipped_file_numbers():
    """How many numbers others have used, if at least one block of 1024 numbers: each CPU takes such a block."""
    last = file_number()
    for _ in range(1100):
        number = file_number()
        if number - last > 1024:
            return number - last
        last = number
    return 0


def event_number():
    """The number of a new event counter: the lowest that is free on the host."""
    file = libc.eventfd(0, 0)
    lines = open(f"/proc/self/fdinfo/{file}").read().split()
    os.close(file)
    return int(lines[lines.index("eventfd-id:") + 1])


def memory_number():
    """The inode number of new shared memory: each CPU takes 1024 of them at a time."""
    for _ in range(1100):
        block = mmap.mmap(-1, 4096)
        lines = [line for line in open("/proc/self/maps") if "/dev/zero" in line]
        number = int(lines[-1].split()[4])
        block.close()
        if number % 1024 == 1:
            return number
    return 0


def skipped_memory_numbers():
    """How many numbers of shared memory others have used since the last call, in blocks."""
    last = skipped_memory_numbers.last
    skipped_memory_numbers.last = memory_number()
    return skipped_memory_numbers.last - last


skipped_memory_numbers.last = 0


def map_library(path="pydoc_data/topics.py"):
    """A page of a file that agents share, in this process's memory."""
    file = os.open(os.path.join(os.path.dirname(os.__file__), path), os.O_RDONLY)
    libc.mmap.restype = ctypes.c_void_p
    libc.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t] + [ctypes.c_int] * 3 + [ctypes.c_long]
    page = libc.mmap(None, 4096, 1, 1, file, 40 * 4096)
    os.close(file)
    ctypes.string_at(page, 1)
    return page


def mapped_by_others():
    """Is a page of a shared file also in another process's memory?"""
    page = map_library()
    with open("/proc/self/pagemap", "rb", buffering=0) as entries:
        (entry,) = struct.unpack("Q", os.pread(entries.fileno(), 8, page // 4096 * 8))
    libc.munmap(ctypes.c_void_p(page), 4096)
    return 1 - (entry >> 56 & 1)


def pass_over_memory():
    """Time of a pass over 8 MiB, in ns."""
    start = time.perf_counter_ns()
    bytes(work)
    return time.perf_counter_ns() - start


def use_memory():
    end = time.perf_counter() + 0.004
    while time.perf_counter() < end:
        bytes(work)


work = bytearray(8 << 20)
# Channels that remain: how to send a one, and what the receiver reads.
remaining = {
    "file_numbers": (lambda: [file_number() for _ in range(2200)], skipped_file_numbers),
    "memory_numbers": (lambda: [mmap.mmap(-1, 4096).close() for _ in range(2200)], skipped_memory_numbers),
    "event_numbers": (lambda: held.extend(libc.eventfd(0, 0) for _ in range(50)), event_number),
    "mapped_pages": (lambda: held.append(("page", map_library())), mapped_by_others),
    "memory_bandwidth": (use_memory, lambda: min(pass_over_memory() for _ in range(2))),
}

actions = {"read": read, "user": user, "move": move, "session": session, "end": release}
for line in sys.stdin:
    action, _, channel = line.strip().partition(" ")
    if channel:
        signal, observe = remaining[channel]
        answer = observe() if action == "observe" else signal() and None
    else:
        answer = actions[action]()
    print(json.dumps(answer), flush=True)
