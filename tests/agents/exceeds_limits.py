"""Exceeds a limit: exceeds_limits.py MARK RESOURCE. MARK identifies its processes for the test. Prints a number and a reason (the
number of successes, and the error that ended them), then echoes lines."""
import errno
import mmap
import os
import resource
import signal
import sys

MIB = 1 << 20


def until_refused(action):
    """The number of times that `action` succeeds, and the error that ends it."""
    count = 0
    while True:
        try:
            action(count)
        except OSError as error:
            return count, error.strerror
        count += 1


def memory():
    blocks = []
    while True:
        blocks.append(b"x" * MIB)


def grow_in_a_child():
    child = os.fork()
    if child == 0:
        memory()
    _, status = os.waitpid(child, 0)
    return os.WTERMSIG(status), "child"


def scratch(folder, size=MIB):
    block = b"x" * size
    with open(os.path.join(folder, "fill"), "wb", buffering=0) as file:
        def step(_):
            # A full disk may accept part of a block first.
            if file.write(block) < size:
                raise OSError(errno.ENOSPC, "No space left on device")
        return until_refused(step)


def one_file():
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    return scratch("/tmp")


def inodes():
    """Empty files need memory, though no space."""
    return until_refused(lambda number: os.close(os.open(f"/tmp/{number}", os.O_CREAT | os.O_WRONLY)))


def descriptors():
    return until_refused(lambda _: os.dup(0))


def shared_memory():
    region = mmap.mmap(-1, 8 << 30)
    for page in range(0, 8 << 30, 4096):
        region[page] = 1


def raise_limits():
    refused = []
    for name in ("RLIMIT_NOFILE", "RLIMIT_FSIZE", "RLIMIT_CORE", "RLIMIT_MEMLOCK"):
        _, hard = resource.getrlimit(getattr(resource, name))
        try:
            resource.setrlimit(getattr(resource, name), (hard + 1, hard + 1))
        except (OSError, ValueError):
            refused.append(name)
    return len(refused), "refused"


def core():
    return resource.getrlimit(resource.RLIMIT_CORE)[1], "core"


kinds = {
    "memory": memory, "child": grow_in_a_child, "scratch": lambda: scratch("/tmp"),
    "shm": lambda: scratch("/dev/shm"), "file": one_file, "inodes": inodes, "descriptors": descriptors,
    "shared": shared_memory, "limits": raise_limits, "core": core,
}
print(*kinds[sys.argv[2]](), flush=True)
for line in sys.stdin:
    print(line.strip(), flush=True)
