"""Uses the system as programs and runtimes of all languages do: uses_system.py MARK MEMORY_BYTES, with the agent's memory. MARK identifies
its processes for the test. Reports `ok` or the error for each function by its name."""
import ctypes
import errno
import fcntl
import http.server
import json
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
import urllib.request
import zoneinfo


libc = ctypes.CDLL(None, use_errno=True)


def error_of(action):
    try:
        action()
    except OSError as error:
        return errno.errorcode[error.errno]


def file_locks():
    name = "/tmp/lock"
    with open(name, "w") as one, open(name, "w") as two:
        fcntl.flock(one, fcntl.LOCK_EX)
        assert error_of(lambda: fcntl.flock(two, fcntl.LOCK_EX | fcntl.LOCK_NB)) == "EAGAIN"
        fcntl.flock(one, fcntl.LOCK_SH)
        fcntl.flock(two, fcntl.LOCK_SH)
        assert error_of(lambda: fcntl.flock(two, fcntl.LOCK_EX | fcntl.LOCK_NB)) == "EAGAIN"
        fcntl.flock(one, fcntl.LOCK_UN)
        fcntl.flock(two, fcntl.LOCK_EX)
    # The end of a file ends its lock.
    with open(name, "w") as one:
        fcntl.flock(one, fcntl.LOCK_EX | fcntl.LOCK_NB)
    assert error_of(lambda: fcntl.flock(1000, fcntl.LOCK_EX)) == "EBADF"


def waits_for_locks():
    script = (
        "import fcntl, sys\nfile = open('/tmp/count', 'r+')\nfor _ in range(20):\n"
        " fcntl.flock(file, fcntl.LOCK_EX); file.seek(0); count = int(file.read())\n"
        " file.seek(0); file.write(str(count + 1)); file.flush(); fcntl.flock(file, fcntl.LOCK_UN)"
    )
    with open("/tmp/count", "w") as file:
        file.write("0")
    processes = [subprocess.Popen([sys.executable, "-c", script]) for _ in range(4)]
    assert [process.wait() for process in processes] == [0] * 4
    with open("/tmp/count") as file:
        assert file.read() == "80"
    # A process that waits can be killed.
    with open("/tmp/count") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        waiting = subprocess.Popen([sys.executable, "-c", script])
        time.sleep(0.2)
        waiting.kill()
        assert waiting.wait() == -signal.SIGKILL


def many_waiting_locks():
    refused, threads = [], []

    def wait_for_lock():
        with open("/tmp/many", "w") as file:
            if error := error_of(lambda: fcntl.flock(file, fcntl.LOCK_EX)):
                refused.append(error)

    with open("/tmp/many", "w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        threads = [threading.Thread(target=wait_for_lock) for _ in range(40)]
        [thread.start() for thread in threads]
        while len(refused) < 8:
            time.sleep(0.01)
        fcntl.flock(file, fcntl.LOCK_UN)
    [thread.join() for thread in threads]
    assert refused == ["ENOLCK"] * 8, refused
    # No lock is left behind.
    with open("/tmp/many") as file:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def locks_of_shared_files():
    with open(json.__file__) as file:
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        fcntl.flock(file, fcntl.LOCK_UN)
        assert error_of(lambda: fcntl.flock(file, fcntl.LOCK_EX)) == "ENOSYS"


def orphans():
    """Processes whose parents have ended: more than the limit on processes."""
    for _ in range(200):
        if (child := os.fork()) == 0:
            if os.fork() == 0:
                os._exit(0)
            os._exit(0)
        os.waitpid(child, 0)
    assert os.getppid() == 1


def connections():
    for family, address in ((socket.AF_INET, "127.0.0.1"), (socket.AF_INET6, "::1")):
        if family == socket.AF_INET6 and not has_ipv6():
            continue
        with socket.create_server((address, 0), family=family) as server:
            with socket.create_connection(server.getsockname()[:2]) as client:
                peer, _ = server.accept()
                with peer:
                    client.sendall(b"x" * 100_000)
                    received = b""
                    while len(received) < 100_000:
                        received += peer.recv(1 << 16)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.bind(("localhost", 0))
        udp.sendto(b"y", udp.getsockname())
        assert udp.recv(1) == b"y"


def has_ipv6():
    try:
        with open("/proc/self/net/if_inet6") as file:
            return file.read() != ""
    except FileNotFoundError:
        return False


def web():
    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.end_headers()
            self.wfile.write(b"hello")

        def log_message(self, *_):
            pass

    with http.server.ThreadingHTTPServer(("localhost", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        for _ in range(20):
            with urllib.request.urlopen(f"http://localhost:{server.server_port}/") as answer:
                assert answer.read() == b"hello"
        server.shutdown()


def names():
    assert socket.gethostname() == "agent"
    assert socket.gethostbyname("agent") == "127.0.0.1"
    assert socket.gethostbyname("localhost") == "127.0.0.1"
    try:
        socket.gethostbyname("example.org")
    except socket.gaierror:
        return
    raise AssertionError("a name of the internet was found")


def interfaces():
    for _ in range(20):
        assert [name for _, name in socket.if_nameindex()] == ["lo"]
    ask_for_neighbour_tables, dump, done = 66, 0x301, 3
    with socket.socket(16, socket.SOCK_RAW | socket.SOCK_CLOEXEC, 0) as route:
        route.send(struct.pack("=IHHIIB3x", 20, ask_for_neighbour_tables, dump, 1, 0, 0))
        # The end of the list comes with the tables, which are hidden, or alone.
        route.settimeout(0.2)
        try:
            assert struct.unpack_from("=IH", route.recv(1 << 16))[1] == done
        except TimeoutError:
            pass
        assert error_of(lambda: route.setsockopt(socket.SOL_SOCKET, 27, 0)) == "EPERM"


def connection_limit():
    """Connections that are never accepted: each has a socket without a descriptor."""
    with socket.create_server(("127.0.0.1", 0), backlog=4096) as server, socket.socket() as client:
        refusal, made = None, 0
        while refusal is None and made < 1000:
            refusal = error_of(lambda: client.connect(server.getsockname()))
            made += 1
            # An address of no family (AF_UNSPEC) ends a connection.
            libc.connect(client.fileno(), bytes(16), 16)
    assert refusal == "ENFILE" and made < 256, (refusal, made)


def socket_limit():
    opened = []
    try:
        refusal = error_of(lambda: [opened.append(socket.socket()) for _ in range(1000)])
    finally:
        for one in opened:
            one.close()
    assert refusal == "ENFILE" and 200 < len(opened) <= 256, (refusal, len(opened))
    socket.socket().close()


def memory():
    expected = int(sys.argv[2])
    assert os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") == expected
    with open("/proc/meminfo") as file:
        total = next(line for line in file if line.startswith("MemTotal:"))
    assert int(total.split()[1]) * 1024 == expected, total


def time_zones():
    assert zoneinfo.ZoneInfo("Europe/Berlin").key == "Europe/Berlin"
    os.environ["TZ"] = "Asia/Tokyo"
    time.tzset()
    assert time.localtime(0).tm_hour == 9
    del os.environ["TZ"]
    time.tzset()
    assert time.localtime(0).tm_hour == 0


def log_by_path():
    for path in ("/dev/stderr", "/proc/self/fd/2", "/dev/fd/2"):
        with open(path, "w") as log:
            print("written by path", file=log)
    subprocess.run(["/bin/sh", "-c", "echo written by shell > /dev/stderr"], check=True)


def pins():
    everything = os.sched_getaffinity(0)
    assert everything == set(range(os.cpu_count())), everything
    started, done = threading.Event(), threading.Event()

    def wait():
        started.set()
        done.wait()

    thread = threading.Thread(target=wait)
    thread.start()
    started.wait()
    process = subprocess.Popen(["/bin/sh", "-c", "read x"], stdin=subprocess.PIPE)
    for number in (0, thread.native_id, process.pid, os.getpid()):
        try:
            os.sched_setaffinity(number, {0})
        except PermissionError:
            # No cpuset confines the agent on this host.
            continue
        assert os.sched_getaffinity(number) == {0}
    assert error_of(lambda: os.sched_setaffinity(0, {900})) in ("EINVAL", "EPERM")
    assert error_of(lambda: os.sched_getaffinity(99_999)) == "ESRCH"
    done.set(), thread.join(), process.communicate()
    try:
        os.sched_setaffinity(0, everything)
    except PermissionError:
        pass


found = {}
for task in (
    file_locks, waits_for_locks, many_waiting_locks, locks_of_shared_files, orphans, connections, web, names, interfaces, socket_limit, connection_limit, memory, time_zones, log_by_path,
    pins,
):
    try:
        task()
        found[task.__name__] = "ok"
    except Exception as error:  # noqa: BLE001, each error is reported
        found[task.__name__] = f"{type(error).__name__}: {error}"
print(json.dumps(found), flush=True)
