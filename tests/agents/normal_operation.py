"""Uses the facilities that agents may use, and reports the results."""
import asyncio
import ctypes
import json
import mmap
import multiprocessing
import os
import subprocess
import sys
import tempfile
import threading
from multiprocessing import shared_memory


def square(number):
    return number * number


def in_a_pool():
    with multiprocessing.Pool(2) as pool:
        return pool.map(square, range(5))


def in_a_thread():
    results = []
    thread = threading.Thread(target=lambda: results.append(square(7)))
    thread.start()
    thread.join()
    return results


def in_a_loop():
    async def child():
        process = await asyncio.create_subprocess_exec(sys.executable, "-c", "print(6)", stdout=-1)
        return (await process.communicate())[0].decode().strip()
    return asyncio.run(child())


def in_shared_memory():
    block = shared_memory.SharedMemory(create=True, size=1 << 20)
    block.buf[0] = 42
    value = block.buf[0]
    block.close()
    block.unlink()
    return value


def in_a_file():
    with tempfile.NamedTemporaryFile() as file:
        file.write(b"x" * 1000)
        file.flush()
        with mmap.mmap(file.fileno(), 0) as mapped:
            return len(mapped)


if __name__ == "__main__":
    print(json.dumps({
        "pool": in_a_pool(),
        "thread": in_a_thread(),
        "loop": in_a_loop(),
        "shared_memory": in_shared_memory(),
        "file": in_a_file(),
        "shell": subprocess.run("echo $HOME", shell=True, capture_output=True, text=True).stdout.strip(),
        "c_library": ctypes.CDLL(None).abs(-3),
        "random": len(os.urandom(8)),
        "home": os.path.expanduser("~"),
    }), flush=True)
