#!/usr/bin/env python3
"""Runs a command without system calls that make namespaces and mounts, as containers without privileges do: contained.py COMMAND…"""

import ctypes
import errno
import os
import struct
import sys

# Numbers of unshare, mount, setns, clone and clone3.
NUMBERS = {"x86_64": (272, 165, 308, 56, 435), "aarch64": (97, 40, 268, 220, 435)}
CLONE_NEWUSER = 0x10000000
ALLOW, REFUSE = 0x7FFF0000, 0x00050000
LOAD, IF_EQUAL, IF_BIT, RETURN = 0x20, 0x15, 0x45, 0x06
NUMBER_OFFSET, FIRST_ARGUMENT_OFFSET = 0, 16


def instruction(code: int, value: int, if_true: int = 0, if_false: int = 0) -> bytes:
    return struct.pack("HBBI", code, if_true, if_false, value)


def refuse(number: int, error: int) -> bytes:
    return instruction(IF_EQUAL, number, if_false=1) + instruction(RETURN, REFUSE | error)


unshare, mount, setns, clone, clone3 = NUMBERS[os.uname().machine]
program = (
    instruction(LOAD, NUMBER_OFFSET)
    + b"".join(refuse(number, errno.EPERM) for number in (unshare, mount, setns))
    # Its flags are in memory, which no filter can read. With this error the C library uses clone instead.
    + refuse(clone3, errno.ENOSYS)
    + instruction(IF_EQUAL, clone, if_false=3)
    + instruction(LOAD, FIRST_ARGUMENT_OFFSET)
    + instruction(IF_BIT, CLONE_NEWUSER, if_false=1)
    + instruction(RETURN, REFUSE | errno.EPERM)
    + instruction(RETURN, ALLOW)
)


class Filter(ctypes.Structure):
    _fields_ = [("length", ctypes.c_ushort), ("instructions", ctypes.c_char_p)]


PR_SET_NO_NEW_PRIVS, PR_SET_SECCOMP, SECCOMP_MODE_FILTER = 38, 22, 2
libc = ctypes.CDLL(None, use_errno=True)
for arguments in (
    (PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0),
    (PR_SET_SECCOMP, SECCOMP_MODE_FILTER, ctypes.byref(Filter(len(program) // 8, program)), 0, 0),
):
    if libc.prctl(*arguments) != 0:
        sys.exit(f"error: prctl: {os.strerror(ctypes.get_errno())}")
os.execvp(sys.argv[1], sys.argv[1:])
