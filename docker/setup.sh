#!/bin/sh
# Installs the system packages that are missing, on a host or in an image.
#
#   docker/setup.sh build    to compile and run the service (cc for the C parts of SQLite and zstd,
#                            bubblewrap for the sandbox)
#   docker/setup.sh test     also the tools of the tests (such as a browser for the pages)
#   docker/setup.sh load     also HTTP load generators
#   docker/setup.sh steady   also a CPU load generator for repeated tests
#   docker/setup.sh cgroup2  also a virtual machine for the tests of cgroup v2
#   docker/setup.sh box      also tools to build images without a container engine
#   docker/setup.sh first-hour   also tools to make a Debian and its network
#   docker/setup.sh languages    also the languages of agents
#   docker/setup.sh python-versions   also a tool to make the files of a Debian release
#   docker/setup.sh engine   also Docker, tools for its base images, and other tools that save images
#
# As root it installs them with apt-get; otherwise it prints the command and fails.
set -eu
# Folder of server programs, often not in the PATH of ordinary users.
PATH=$PATH:/usr/sbin

purpose=${1:-build}
missing=''
need() { # need COMMAND PACKAGE
    command -v "$1" >/dev/null 2>&1 || missing="$missing $2"
}

need cc build-essential
need bwrap bubblewrap
# Interpreter of the reference agents.
need python3 python3
# Root certificates for webhooks over TLS.
[ -e /etc/ssl/certs/ca-certificates.crt ] || missing="$missing ca-certificates"
if [ "$purpose" = test ] || [ "$purpose" = steady ]; then
    need chromium chromium
    # pip of the agents' Python, to create the runtime python3-ml (docker/runtime.sh).
    /usr/bin/python3 -m pip --version >/dev/null 2>&1 || missing="$missing python3-pip"
    # The Python package is tested in a virtual environment.
    python3 -c 'import ensurepip' 2>/dev/null || missing="$missing python3-venv"
    # A TypeScript client of the API is generated and run.
    need node nodejs
    need npm npm
    # Remote workers get their jobs through NATS.
    need nats-server nats-server
    # For a worker with a wrong clock.
    ls /usr/lib/*/faketime/libfaketime.so.1 >/dev/null 2>&1 || missing="$missing libfaketime"
    # To write database contents that no version of the server writes.
    need sqlite3 sqlite3
    # To check the examples for organisers: the systemd units and the proxies.
    need systemd-analyze systemd
    need nginx nginx-light
    [ -e /usr/lib/nginx/modules/ngx_stream_module.so ] || missing="$missing libnginx-mod-stream"
    need caddy caddy
    # A common client, for refused uploads.
    need curl curl
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
if [ "$purpose" = first-hour ]; then
    need debootstrap debootstrap
    need ip iproute2
fi
if [ "$purpose" = python-versions ]; then
    need mmdebstrap mmdebstrap
fi
if [ "$purpose" = languages ]; then
    need g++ g++
    need javac openjdk-17-jdk-headless
    need node nodejs
    need lua5.4 lua5.4
    [ -e /usr/share/lua/5.4/cjson ] || missing="$missing lua-cjson"
    need mono mono-runtime
    need mcs mono-mcs
    [ -e /usr/lib/mono/4.5/System.Core.dll ] || missing="$missing libmono-system-core4.0-cil"
    need mmdebstrap mmdebstrap
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
# Do not start the installed servers: the tests start them.
export RUNLEVEL=1
apt-get update -qq
# shellcheck disable=SC2086 # a list of words on purpose
apt-get install -y -qq --no-install-recommends $missing >/dev/null
