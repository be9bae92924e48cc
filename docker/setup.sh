#!/bin/sh
# Installs the system packages that are missing, on a host or in an image.
#
#   docker/setup.sh build    to compile and run the service (cc for the C parts of SQLite and zstd,
#                            bubblewrap for the sandbox)
#   docker/setup.sh test     also what the tests drive (a browser, so that pages are really opened)
#   docker/setup.sh load     also what asks a server for pages, as often as it can
#   docker/setup.sh steady   also what keeps the machine busy while the tests run again and again
#   docker/setup.sh cgroup2  also a virtual machine, for the tests of the other version of control groups
#   docker/setup.sh box      also what the images are made of, where no engine makes them
#   docker/setup.sh engine   also Docker, what its images are made of, and who else saves images
#
# As root it installs them with apt-get; otherwise it prints the command and fails.
set -eu
# Where ordinary users do not look, and servers are.
PATH=$PATH:/usr/sbin

purpose=${1:-build}
missing=''
need() { # need COMMAND PACKAGE
    command -v "$1" >/dev/null 2>&1 || missing="$missing $2"
}

need cc build-essential
need bwrap bubblewrap
# Reference agents are interpreted by it.
need python3 python3
# Whom to trust, when webhooks are told by TLS.
[ -e /etc/ssl/certs/ca-certificates.crt ] || missing="$missing ca-certificates"
if [ "$purpose" = test ] || [ "$purpose" = steady ]; then
    need chromium chromium
    # Of the Python that agents get, to make the runtime python3-ml (docker/runtime.sh).
    /usr/bin/python3 -m pip --version >/dev/null 2>&1 || missing="$missing python3-pip"
    # The Python package is tested in an environment of its own.
    python3 -c 'import ensurepip' 2>/dev/null || missing="$missing python3-venv"
    # A client of the API in TypeScript is made and run.
    need node nodejs
    need npm npm
    # Workers on other machines are given work by it.
    need nats-server nats-server
    # A worker gets a clock that is wrong.
    ls /usr/lib/*/faketime/libfaketime.so.1 >/dev/null 2>&1 || missing="$missing libfaketime"
    # Databases are given what no version of ours writes.
    need sqlite3 sqlite3
    # The examples for organisers are tried: systemd's own judgement of the unit, and the proxies.
    need systemd-analyze systemd
    need nginx nginx-light
    need caddy caddy
fi
if [ "$purpose" = load ]; then
    need wrk wrk
    need hey hey
fi
if [ "$purpose" = cgroup2 ]; then
    need qemu-system-x86_64 qemu-system-x86
    need busybox busybox-static
    need cpio cpio
fi
if [ "$purpose" = box ]; then
    need mmdebstrap mmdebstrap
    need nats-server nats-server
    need curl curl
    need ip iproute2
    python3 -c 'import ensurepip' 2>/dev/null || missing="$missing python3-venv"
fi
if [ "$purpose" = engine ]; then
    need dockerd docker.io
    need docker docker.io
    need mmdebstrap mmdebstrap
    need capsh libcap2-bin
    need curl curl
    need skopeo skopeo
    need podman podman
    python3 -c 'import yaml' 2>/dev/null || missing="$missing python3-yaml"
fi
if [ "$purpose" = steady ]; then
    need stress-ng stress-ng
    need column bsdextrautils
fi

if ! command -v cargo >/dev/null 2>&1; then
    echo "error: cargo is not on the PATH; install Rust with rustup (https://rustup.rs), then run this again" >&2
    exit 1
fi

[ -n "$missing" ] || exit 0

if [ "$(id -u)" -ne 0 ]; then
    echo "error: these Debian packages are missing:$missing" >&2
    echo "run:   sudo apt-get update && sudo apt-get install -y --no-install-recommends$missing" >&2
    exit 1
fi
echo "installing:$missing"
export DEBIAN_FRONTEND=noninteractive
# Servers are installed to be started by tests, not by themselves.
export RUNLEVEL=1
apt-get update -qq
# shellcheck disable=SC2086 # a list of words on purpose
apt-get install -y -qq --no-install-recommends $missing >/dev/null
