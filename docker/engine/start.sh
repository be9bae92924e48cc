# Sourced by docker/test-engine.sh: a separate engine, and the base images of the Dockerfile.
# shellcheck shell=sh
: "${work:?}" "${folder:?}"

# Starts a Docker engine of its own. It shares nothing with an existing engine: no data, socket, configuration or containerd namespace. It
# does not change the host's firewall, and its networks are removed with it. `work` is the folder of data that stay, `run` of temporary
# data. The path of `run` is short, since a socket's path has at most 107 bytes.
engine_start() {
    run=$(mktemp -d /tmp/faceoff-engine-XXXXXX)
    echo '{}' >"$run/daemon.json"
    # `privileged` requests all capabilities of the kernel. A host that is itself a container or a small virtual machine may lack one, and
    # runc then fails; so there the wrapper requests only the available ones.
    runtime=''
    bounding=$(awk '$1 == "CapBnd:" { print $2 }' /proc/self/status)
    all=$(printf %016x $(((1 << ($(cat /proc/sys/kernel/cap_last_cap) + 1)) - 1)))
    if [ "$bounding" != "$all" ]; then
        echo "this host lacks capabilities, and so do its privileged containers: $bounding of $all"
        install -m 755 "$folder/engine/runc.py" "$run/runc"
        runtime="--add-runtime host=$run/runc --default-runtime host"
    fi
    rm -rf "$work/data"
    # shellcheck disable=SC2086 # split into words
    setsid dockerd --config-file "$run/daemon.json" --host "unix://$run/sock" --pidfile "$run/pid" --exec-root "$run/exec" \
        --data-root "$work/data" --containerd-namespace "${run##*/}" --containerd-plugins-namespace "${run##*/}-plugins" \
        --exec-opt native.cgroupdriver=cgroupfs --bridge none --iptables=false --ip6tables=false $runtime >"$work/dockerd.log" 2>&1 9>&- &
    engine=$!
    export DOCKER_HOST="unix://$run/sock"
    # The built-in builder of the engine; BuildKit is a plugin of the client.
    export DOCKER_BUILDKIT=0
    for _ in $(seq 120); do
        ! docker info >/dev/null 2>&1 || return 0
        kill -0 $engine 2>/dev/null || break
        sleep 0.5
    done
    cat "$work/dockerd.log" >&2
    fail "dockerd does not start"
}

# Stops the engine and its containers, and removes its data; the base images' file systems stay.
engine_stop() {
    [ -n "${engine:-}" ] || return 0
    if kill -0 "$engine" 2>/dev/null; then
        # shellcheck disable=SC2046 # split into words
        docker rm --force --volumes $(docker ps --all --quiet) >/dev/null 2>&1 || true
        docker network prune --force >/dev/null 2>&1 || true
        kill "$engine"
        wait "$engine" 2>/dev/null || true
    fi
    # The kernel writes a space as \040.
    awk -v a="$run/" -v b="$work/data/" '{ gsub(/\\040/, " ", $5) } index($5, a) == 1 || index($5, b) == 1 { print $5 }' /proc/self/mountinfo |
        sort -r | while IFS= read -r mounted; do umount --lazy "$mounted" || true; done
    rm -rf "$run" "$work/data"
}

# quietly COMMAND…: prints its output only if it fails.
quietly() {
    "$@" >"$work/log" 2>&1 || {
        cat "$work/log" >&2
        fail "$*"
    }
}

# base_image TAG: builds a Debian image from packages. The slim images are minbase without documentation.
base_image() {
    suite=${1#debian:}
    suite=${suite%-slim}
    [ -e "$work/$suite.tar" ] || {
        quietly mmdebstrap --variant=minbase --dpkgopt='path-exclude=/usr/share/doc/*' --dpkgopt='path-exclude=/usr/share/man/*' \
            --dpkgopt='path-exclude=/usr/share/locale/*' "$suite" "$work/part.tar"
        mv "$work/part.tar" "$work/$suite.tar"
    }
    quietly docker import --change 'ENV PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin' "$work/$suite.tar" "$1"
}

# build_image TAG: builds an image from the Dockerfile on standard input and the files in $work/context, which are removed.
build_image() {
    cat >"$work/context/Dockerfile"
    quietly docker build --network host --tag "$1" "$work/context"
    rm -rf "$work/context"
    mkdir "$work/context"
}

# rust_image TAG BASE: an image with the toolchain and the root certificates of this host, since crates.io may be behind a proxy.
rust_image() {
    sysroot=$(rustc --print sysroot)
    mkdir "$work/context/rust"
    for part in bin lib libexec; do
        [ ! -d "$sysroot/$part" ] || cp -a "$sysroot/$part" "$work/context/rust"
    done
    rm -rf "$work/context/rust/lib/rustlib/src"
    cp -L /etc/ssl/certs/ca-certificates.crt "$work/context"
    build_image "$1" <<END
FROM $2
RUN apt-get update && apt-get install -y --no-install-recommends build-essential ca-certificates && rm -rf /var/lib/apt/lists/*
COPY rust /usr/local
COPY ca-certificates.crt /etc/ssl/certs/ca-certificates.crt
END
}
