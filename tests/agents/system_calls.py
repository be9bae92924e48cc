"""Makes system calls by number (x86-64) and reports each one's error name, or `ok`."""
import ctypes
import errno
import json
import os

libc = ctypes.CDLL(None, use_errno=True)
libc.syscall.restype = ctypes.c_long
memory = ctypes.create_string_buffer(4096)
address = ctypes.addressof(memory)
CLONE_NEWUSER, CLONE_NEWNS, CLONE_NEWNET, SIGCHLD = 0x10000000, 0x00020000, 0x40000000, 17

CLONE = 56

# Each call's number on x86-64 and its arguments.
calls = {
    "ptrace": (101, 0, 0, 0, 0),
    "process_vm_readv": (310, os.getpid(), address, 0, address, 0, 0),
    "process_vm_writev": (311, os.getpid(), address, 0, address, 0, 0),
    "kcmp": (312, os.getpid(), os.getpid(), 0, 0, 1),
    "pidfd_getfd": (438, 0, 0, 0),
    "mount": (165, address, address, address, 0, 0),
    "umount2": (166, address, 0),
    "pivot_root": (155, address, address),
    "chroot": (161, address),
    "fsopen": (430, address, 0),
    "open_tree": (428, -100, address, 1),
    "move_mount": (429, -100, address, -100, address, 0),
    "mount_setattr": (442, -100, address, 0, address, 32),
    "setns": (308, 0, 0),
    "unshare_user": (272, CLONE_NEWUSER),
    "unshare_net": (272, CLONE_NEWNET),
    "clone_newuser": (CLONE, CLONE_NEWUSER | SIGCHLD, 0, 0, 0, 0),
    "clone_newns": (CLONE, CLONE_NEWNS | SIGCHLD, 0, 0, 0, 0),
    "clone3": (435, address, 0),
    "keyctl": (250, 0, -3, 1),
    "add_key": (248, address, address, address, 1, -2),
    "request_key": (249, address, address, 0, -2),
    "bpf": (321, 0, address, 120),
    "perf_event_open": (298, address, 0, -1, -1, 0),
    "io_uring_setup": (425, 4, address),
    "io_uring_enter": (426, 0, 0, 0, 0, 0, 0),
    "io_uring_register": (427, 0, 0, 0, 0),
    "userfaultfd": (323, 1),
    "fanotify_init": (300, 0, 0),
    "open_by_handle_at": (304, -100, address, 0),
    "name_to_handle_at": (303, -100, address, address, address, 0),
    "kexec_load": (246, 0, 0, 0, 0),
    "reboot": (169, 0, 0, 0, 0),
    "swapon": (167, address, 0),
    "init_module": (175, address, 0, address),
    "delete_module": (176, address, 0),
    "acct": (163, address),
    "quotactl": (179, 0, address, 0, address),
    "syslog": (103, 10, 0, 0),
    "sethostname": (170, address, 1),
    "settimeofday": (164, address, 0),
    "personality": (135, 0xFFFFFFFF),
    "sched_setattr": (314, 0, address, 1 << 30),
    "seccomp": (317, 2, 0, address),
    "modify_ldt": (154, 0, address, 0),
    "iopl": (172, 3),
    "socket_raw": (41, 2, 3, 1),
    "socket_netlink_diagnosis": (41, 16, 3, 4),
    "socket_packet": (41, 17, 3, 0),
    "socketpair_inet": (53, 2, 1, 0, address),
    "newer_than_known": (463, -100, address, 0, address, address, 0),
    "x32_getpid": (0x40000000 | 39,),
}


def call(number, *arguments):
    ctypes.set_errno(0)
    result = libc.syscall(ctypes.c_long(number), *(ctypes.c_long(value) for value in arguments))
    if result == 0 and number == CLONE:
        # This is the child.
        os._exit(0)
    return "ok" if result != -1 else errno.errorcode[ctypes.get_errno()]


def reset_parent_death_signal():
    """Resets the signal at the parent's death, and returns the signal that is still set."""
    signal_left = ctypes.c_int(-1)
    libc.prctl(1, 0)
    libc.prctl(2, ctypes.byref(signal_left))
    return str(signal_left.value)


answers = {name: call(*arguments) for name, arguments in calls.items()}
print(json.dumps({**answers, "parent_death_signal": reset_parent_death_signal()}), flush=True)
