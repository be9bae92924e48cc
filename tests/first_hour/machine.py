"""A small Debian system with an ordinary user, in namespaces of its own: its files, processes and network end with it.

Its files are a minimal Debian (debootstrap) that is made once and cached; each machine writes into a layer in memory. It is no chroot, because
the kernel allows no user namespaces in one, and the sandbox needs them.
"""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

USER, HOME = "ada", "/home/ada"
USER_ID = "1000"
# Longer than any command takes on a working machine.
TIMEOUT_S = 1200
PATH = "/usr/local/bin:/usr/bin:/bin"

# Becomes process 1 of the machine.
BOOT = """
set -eu
base=$1 program=$2 work=$3 setup=$4
mount -t tmpfs -o mode=755 memory "$work"
mkdir "$work/upper" "$work/work" "$work/root"
mount -t overlay -o "lowerdir=$base,upperdir=$work/upper,workdir=$work/work" root "$work/root"
cd "$work/root"
mount -t proc proc proc
mount --rbind /sys sys
mount --rbind /dev dev
mount -t tmpfs -o mode=1777 memory tmp
install -m 755 "$program" usr/local/bin/faceoff
ip link set lo up
mkdir -p old
pivot_root . old
cd /
umount -l /old
rmdir /old
useradd --create-home --shell /bin/bash --uid USER_ID USER
eval "$setup"
echo ready
exec </dev/null >/dev/null 2>&1
sleep infinity &
while :; do wait || :; done
""".replace("USER_ID", USER_ID).replace("USER", USER)


def debian(suite: str, packages: list[str], cache: Path) -> Path:
    """The root file system of a minimal Debian with these packages; made if the cache has none."""
    root, made_with = cache / suite, cache / f"{suite}.packages"
    wanted = " ".join(packages)
    if made_with.exists() and made_with.read_text() == wanted:
        return root
    print(f"making a Debian {suite} with {wanted} in {root}", flush=True)
    made_with.unlink(missing_ok=True)
    shutil.rmtree(root, ignore_errors=True)
    root.mkdir(parents=True)
    include = ["--include", ",".join(packages)] if packages else []
    # debootstrap mounts /proc; if it is interrupted, its mount namespace ends with it.
    command = ["unshare", "--mount", "debootstrap", "--variant=minbase", *include, suite, str(root), "http://deb.debian.org/debian"]
    made = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if made.returncode != 0:
        raise SystemExit(f"error: debootstrap ended with status {made.returncode}:\n{made.stdout[-2000:]}")
    made_with.write_text(wanted)
    return root


class Machine:
    """A running machine, to be used in a `with` statement."""

    def __init__(self, root: Path, program: Path, setup: str = ":"):
        """`setup`: shell commands that root runs in the machine before the user does anything."""
        self.work = tempfile.mkdtemp(prefix="first-hour-")
        namespaces = ["--mount", "--net", "--pid", "--fork", "--kill-child", "--propagation", "private"]
        command = ["unshare", *namespaces, "sh", "-c", BOOT, "sh", str(root), str(program), self.work, setup]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        if self.process.stdout.readline() != "ready\n":
            _, errors = self.process.communicate()
            self.stop()
            raise SystemExit(f"error: the machine did not start:\n{errors}")
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text()
        self.first_process = children.split()[0]

    def __enter__(self) -> "Machine":
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        """Ends all processes of the machine, and so removes its mounts."""
        self.process.kill()
        self.process.communicate()
        os.rmdir(self.work)

    def enter(self, *options: str) -> list[str]:
        """The beginning of a command that runs in these namespaces of the machine; by default in all."""
        return ["nsenter", "--target", self.first_process, *(options or ("--mount", "--net", "--pid"))]

    def run(self, command: str, folder: str = HOME, variables: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
        """Runs a shell command as the user; standard output and standard error are one text, as in a terminal."""
        settings = {"HOME": HOME, "USER": USER, "PATH": PATH, "LANG": "C.UTF-8"} | (variables or {})
        return subprocess.run(
            [
                *self.enter(),
                "setpriv", "--reuid", USER_ID, "--regid", USER_ID, "--clear-groups", "--bounding-set=-all", "--inh-caps=-all",
                "env", "-i", *(f"{name}={value}" for name, value in settings.items()),
                "sh", "-c", 'cd "$1" && eval "$2"', "sh", folder, command,
            ],  # fmt: skip
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=TIMEOUT_S,
        )
