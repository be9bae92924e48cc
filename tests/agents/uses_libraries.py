"""Uses Python's libraries as ordinary agents do, and reports `ok` or the error for each. The names of the functions are the keys of
the report."""
import asyncio
import concurrent.futures
import ctypes
import dbm
import importlib
import json
import logging.handlers
import mmap
import multiprocessing
import multiprocessing.shared_memory
import os
import queue
import select
import shelve
import shutil
import signal
import socket
import sqlite3
import subprocess
import sys
import tarfile
import tempfile
import threading
import time
import zipfile


def square(number):
    return number * number


def database(path):
    with sqlite3.connect(path) as creator:
        creator.execute("create table t (x)")
        creator.executemany("insert into t values (?)", [(n,) for n in range(100)])
    writer = sqlite3.connect(path, timeout=60)
    reader = sqlite3.connect(path, timeout=60)
    with writer:
        writer.execute("update t set x = x + 1")
    # The sum of 1 to 100.
    assert reader.execute("select sum(x) from t").fetchone() == (5050,)
    writer.close(), reader.close(), creator.close()


def databases():
    with tempfile.TemporaryDirectory() as folder:
        database(os.path.join(folder, "one.db"))
    with sqlite3.connect(":memory:") as memory:
        assert memory.execute("select 1").fetchone() == (1,)


def in_another_process():
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "shared.db")
        with sqlite3.connect(path) as one:
            one.execute("create table t (x)")
        one.close()
        write = "import sqlite3, sys\nc = sqlite3.connect(sys.argv[1], timeout=60)\nwith c: c.execute('insert into t values (1)')"
        command = [sys.executable, "-c", write, path]
        writers = [subprocess.Popen(command, stderr=subprocess.PIPE, text=True) for _ in range(3)]
        errors = [writer.communicate()[1] for writer in writers]
        assert [writer.returncode for writer in writers] == [0, 0, 0], errors
        with sqlite3.connect(path) as one:
            assert one.execute("select count(*) from t").fetchone() == (3,)
        one.close()


def pools():
    with multiprocessing.Pool(2) as pool:
        assert pool.map(square, range(5)) == [0, 1, 4, 9, 16]
    with concurrent.futures.ProcessPoolExecutor(2) as pool:
        assert list(pool.map(square, range(3))) == [0, 1, 4]
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        assert list(pool.map(square, range(3))) == [0, 1, 4]


def spawned():
    context = multiprocessing.get_context("spawn")
    answers = context.Queue()
    process = context.Process(target=answers.put, args=(7,))
    process.start()
    assert answers.get() == 7
    process.join()


def shared():
    block = multiprocessing.shared_memory.SharedMemory(create=True, size=1 << 20)
    block.buf[5] = 42
    second = multiprocessing.shared_memory.SharedMemory(block.name)
    assert second.buf[5] == 42
    second.close(), block.close(), block.unlink()
    with multiprocessing.Manager() as manager:
        numbers = manager.list([1, 2])
        numbers.append(3)
        assert list(numbers) == [1, 2, 3]


def files():
    with tempfile.TemporaryDirectory() as folder:
        name = os.path.join(folder, "a")
        with open(name, "wb") as file:
            file.write(bytes(100_000))
        shutil.copy2(name, name + "b"), os.chmod(name, 0o700), os.utime(name)
        with open(name, "r+b") as file, mmap.mmap(file.fileno(), 0) as view:
            view.madvise(mmap.MADV_WILLNEED), view.madvise(mmap.MADV_SEQUENTIAL)
            os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_SEQUENTIAL)
            assert view[99_999] == 0
            assert os.preadv(file.fileno(), [bytearray(10)], 0) == 10
        with zipfile.ZipFile(name + ".zip", "w") as archive:
            archive.write(name)
        with tarfile.open(name + ".tgz", "w:gz") as archive:
            archive.add(name, "a")
        with tarfile.open(name + ".tgz") as archive:
            archive.extractall(os.path.join(folder, "out"))
        with shelve.open(os.path.join(folder, "shelf"), "c") as shelf:
            shelf["x"] = [1]
    with tempfile.NamedTemporaryFile() as file, tempfile.SpooledTemporaryFile() as spooled:
        file.write(b"x"), spooled.write(b"y")


def timed():
    rang = []
    signal.signal(signal.SIGALRM, lambda *_: rang.append(1))
    signal.setitimer(signal.ITIMER_REAL, 0.001)
    while not rang:
        time.sleep(0.001)
    done = threading.Event()
    threading.Timer(0.001, done.set).start()
    assert done.wait(600)


async def awaited():
    process = await asyncio.create_subprocess_exec("/bin/sh", "-c", "echo 5", stdout=-1)
    out, _ = await process.communicate()
    server = await asyncio.start_unix_server(lambda r, w: w.close(), "/tmp/socket")
    reader, writer = await asyncio.open_unix_connection("/tmp/socket")
    assert await reader.read() == b""
    writer.close(), server.close()
    return int(out)


def sockets():
    one, two = socket.socketpair()
    one.send(b"x")
    with select.epoll() as poller:
        poller.register(two, select.EPOLLIN)
        assert poller.poll(600)
    assert two.recv(1) == b"x"


def logs():
    handler = logging.handlers.RotatingFileHandler("/tmp/log", maxBytes=100, backupCount=2)
    for number in range(20):
        handler.emit(logging.LogRecord("x", 20, "", 0, "message %d", (number,), None))
    handler.close()


def numerics():
    for name in ("numpy", "scipy", "torch"):
        try:
            importlib.import_module(name)
        except ModuleNotFoundError:
            pass


def threads():
    work, answers = queue.Queue(), queue.Queue()
    lock = threading.Lock()

    def run():
        with lock:
            answers.put(work.get() + 1)

    running = [threading.Thread(target=run) for _ in range(8)]
    [thread.start() for thread in running]
    [work.put(n) for n in range(8)]
    [thread.join() for thread in running]
    assert sorted(answers.queue) == list(range(1, 9))


def processors():
    assert os.cpu_count() >= 1 and len(os.sched_getaffinity(0)) >= 1
    assert os.sysconf("SC_PHYS_PAGES") > 0
    assert "MemTotal" in open("/proc/meminfo").read() and "processor" in open("/proc/cpuinfo").read()


def event_loop():
    assert asyncio.run(awaited()) == 5


def libraries():
    assert ctypes.CDLL(None).abs(-3) == 3 and dbm.whichdb("/tmp/none") is None


found = {}
if __name__ == "__main__":
    for task in (
        databases, in_another_process, pools, spawned, shared, files, timed, event_loop, sockets, logs, numerics,
        threads, processors, libraries,
    ):
        try:
            task()
            found[task.__name__] = "ok"
        except Exception as error:  # noqa: BLE001, each error is reported
            found[task.__name__] = f"{type(error).__name__}: {error}"
    completed = subprocess.run(["/bin/sh", "-c", "echo hello"], capture_output=True, text=True, check=True)
    found["subprocess"] = "ok" if completed.stdout == "hello\n" else completed.stdout
    print(json.dumps(found), flush=True)
