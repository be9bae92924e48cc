"""Makes timers that expire at one instant until the limit is reached, and reports their number."""
import ctypes
import errno
import json

libc = ctypes.CDLL(None, use_errno=True)
count, refused = 0, None
timer = ctypes.c_void_p()
SIGEV_NONE, CLOCK_MONOTONIC = 1, 1
# Far above the limit of timers, so that the loop ends even without one.
ENOUGH = 40_000
event = (ctypes.c_int * 16)(0, 0, 0, SIGEV_NONE)
while count < ENOUGH:
    if libc.timer_create(CLOCK_MONOTONIC, ctypes.byref(event), ctypes.byref(timer)) != 0:
        refused = errno.errorcode[ctypes.get_errno()]
        break
    count += 1
print(json.dumps({"timers": count, "refused": refused}), flush=True)
