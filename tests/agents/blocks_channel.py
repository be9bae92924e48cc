"""Blocks or misuses the channels that it shares with the service: blocks_channel.py MARK KIND. MARK identifies its processes for
the test.

It prints `ready`, then acts as KIND says: blocks in system calls on its standard input, output or error (`splice-…`,
`fault-…`), stops itself, closes or shuts down one direction, fills it, writes single bytes, or sends out-of-band data or
file descriptors. Most kinds echo lines afterwards.
"""
import array
import ctypes
import mmap
import os
import select
import signal
import socket
import sys
import threading
import time

KIND = sys.argv[2]
PAGE = 4096
libc = ctypes.CDLL(None, use_errno=True)
# Objects that must not be freed: threads, sockets, memory.
references = []


def start_thread(body):
    references.append(threading.Thread(target=body, daemon=True))
    references[-1].start()


def full_socket():
    """A socket with a full buffer that is never read."""
    pair = socket.socketpair()
    references.extend(pair)
    pair[0].setblocking(False)
    try:
        while True:
            pair[0].send(b"x" * 4096)
    except BlockingIOError:
        pair[0].setblocking(True)
    return pair[0].fileno()


def empty_socket():
    """The end of a socket pair to which nothing is ever sent."""
    pair = socket.socketpair()
    references.extend(pair)
    return pair[0].fileno()


def splice(source, target):
    def body():
        while True:
            try:
                os.splice(source, target, 1 << 16)
            except OSError as error:
                print("splice:", error.strerror, file=sys.stderr, flush=True)
                return
    start_thread(body)


def slow_memory():
    """Memory whose page faults block: they need a lock that a starved thread holds."""
    cpu = max(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {cpu})
    size = 96 << 20
    region = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    region[::4096] = bytes(size // 4096)
    references.append(region)
    address = ctypes.addressof(ctypes.c_char.from_buffer(region))

    def change_protection():
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
        while True:
            for protection in (mmap.PROT_READ, mmap.PROT_READ | mmap.PROT_WRITE):
                libc.mprotect(ctypes.c_void_p(address), ctypes.c_size_t(size), protection)

    start_thread(change_protection)
    for _ in range(3):
        if os.fork() == 0:
            while True:
                pass
    return address, size


def call_with_slow_memory(call):
    """Calls `call(address, size)` for page after page of memory whose page faults block."""
    address, size = slow_memory()

    def body():
        offset = 0
        while True:
            call(ctypes.c_void_p(address + offset), ctypes.c_size_t(PAGE))
            offset = (offset + PAGE) % size
    start_thread(body)


def send(data, flags=0, files=()):
    """Sends bytes, and descriptors of open files, through standard output."""
    with socket.socket(fileno=os.dup(1)) as channel:
        rights = [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", files))] if files else []
        try:
            channel.sendmsg([data], rights, flags)
        except OSError as error:
            print("sendmsg:", error.strerror, file=sys.stderr, flush=True)


def shut_down(fd, direction):
    with socket.socket(fileno=os.dup(fd)) as channel:
        channel.shutdown(direction)


def block():
    if KIND == "splice-output":
        splice(empty_socket(), 1)
    elif KIND == "splice-log":
        splice(empty_socket(), 2)
    elif KIND == "splice-input":
        splice(0, full_socket())
    elif KIND == "fault-output":
        call_with_slow_memory(lambda memory, size: libc.write(1, memory, size))
    elif KIND == "fault-log":
        call_with_slow_memory(lambda memory, size: libc.write(2, memory, size))
    elif KIND == "fault-input":
        call_with_slow_memory(lambda memory, size: libc.read(0, memory, size))
    elif KIND == "shut-input":
        shut_down(0, socket.SHUT_RD)
    elif KIND == "shut-output":
        shut_down(1, socket.SHUT_WR)
    elif KIND == "close-input":
        os.close(0)
    elif KIND == "close-output":
        os.close(1)
    elif KIND == "fills":
        start_thread(lambda: [os.write(1, b"x" * 9999 + b"\n") for _ in iter(int, 1)])
        start_thread(lambda: [os.write(2, b"x" * 9999) for _ in iter(int, 1)])
    elif KIND == "dribbles":
        start_thread(lambda: [(os.write(1, b"x"), os.write(2, b"x"), time.sleep(0.0005)) for _ in iter(int, 1)])
    elif KIND == "watches":
        # 20,000 registrations that wait for space: reading one byte wakes all of them.
        for fd in (1, 2):
            ends = [os.dup(fd) for _ in range(100)]
            for _ in range(100):
                references.append(select.epoll())
                for end in ends:
                    references[-1].register(end, select.EPOLLOUT | select.EPOLLET)
        start_thread(lambda: [(os.write(1, b"x"), os.write(2, b"x")) for _ in iter(int, 1)])
    elif KIND == "out-of-band":
        send(b"x", socket.MSG_OOB)
        send(b"yz", socket.MSG_OOB)
    elif KIND == "passes-files":
        for _ in range(50):
            send(b"x", 0, [0, 1, 2])
    elif KIND == "spins":
        start_thread(lambda: [None for _ in iter(int, 1)])
    elif KIND == "stops":
        os.kill(os.getpid(), signal.SIGSTOP)


if KIND == "stops" and os.fork():
    # The first process of a namespace cannot be stopped from inside, so a child stops itself.
    os.wait()
    sys.exit()
print("ready", flush=True)
block()
if not KIND.endswith("input"):
    for line in sys.stdin:
        if not KIND.endswith("output"):
            sys.stdout.write(line)
            sys.stdout.flush()
signal.pause()
