"""Makes harmless system calls that docker/seccomp.json refuses. Prints the calls and ends with status 1 if one of them does not fail with EPERM, or if
a call that bubblewrap needs does."""

import ctypes
import errno
import os
import sys

NUMBERS = {  # name: x86_64, aarch64
    "add_key": (248, 217),
    "bpf": (321, 280),
    "fsopen": (430, 430),
    "init_module": (175, 105),
    "io_uring_setup": (425, 425),
    "kexec_load": (246, 104),
    "keyctl": (250, 219),
    "open_by_handle_at": (304, 265),
    "perf_event_open": (298, 241),
    "process_vm_readv": (310, 270),
    "ptrace": (101, 117),
    "reboot": (169, 142),
    "settimeofday": (164, 170),
    "swapon": (167, 224),
    "userfaultfd": (323, 282),
}
# These arguments create no namespace and unmount nothing.
NEEDED = {"unshare": ((272, 97), 0), "umount2": ((166, 39), 0)}

libc = ctypes.CDLL(None, use_errno=True)
column = {"x86_64": 0, "aarch64": 1}[os.uname().machine]


def is_refused(number, first):
    """Whether the system call fails with EPERM; its first argument is `first`, all others are 0."""
    ctypes.set_errno(0)
    libc.syscall(ctypes.c_long(number), ctypes.c_long(first), *[ctypes.c_long(0)] * 5)
    return ctypes.get_errno() == errno.EPERM


# -1 is not a valid request of ptrace or flag of the others, and NULL is not a valid name of a file or key.
wrong = [name for name, numbers in NUMBERS.items() if not is_refused(numbers[column], 0 if name == "settimeofday" else -1)]
wrong += [name for name, (numbers, first) in NEEDED.items() if is_refused(numbers[column], first)]
if wrong:
    print("allowed, or refused although needed:", *wrong)
sys.exit(bool(wrong))
