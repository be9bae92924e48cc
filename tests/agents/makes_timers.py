"""Makes timers that expire at one instant until the limit is reached, and reports their number."""
import ctypes
import errno
import json

libc = ctypes.CDLL(None, use_errno=True)
made, refused = 0, None
timer = ctypes.c_void_p()
SIGEV_NONE = 1
event = (ctypes.c_int * 16)(0, 0, 0, SIGEV_NONE)
while made < 40_000:
    if libc.timer_create(1, ctypes.byref(event), ctypes.byref(timer)) != 0:
        refused = errno.errorcode[ctypes.get_errno()]
        break
    made += 1
print(json.dumps({"timers": made, "refused": refused}), flush=True)
