# Sourced by docker/test-engine.sh: an engine of its own, and images by the names from which the Dockerfile is made.
# shellcheck shell=sh
: "${work:?}" "${folder:?}"
#
# It shares nothing with an engine that is there: not its data, its socket, its configuration or its names in containerd. It does not
# touch the host's firewall, and what it adds to its networks goes with it. `work` is the folder of what is kept, `run` of what is not; that one's path is short, for a
# socket's has 107 bytes at most.
engine_start() {
    run=$(mktemp -d /tmp/faceoff-engine-XXXXXX)
    echo '{}' >"$run/daemon.json"
    # `privileged` asks for each capability that the kernel knows. A host that is itself a container or a small virtual machine may lack
    # one, and runc then starts nothing; so there it is asked for what is there.
    runtime=''
    bounding=$(awk '$1 == "CapBnd:" { print $2 }' /proc/self/status)
    all=$(printf %016x $(((1 << ($(cat /proc/sys/kernel/cap_last_cap) + 1)) - 1)))
    if [ "$bounding" != "$all" ]; then
        echo "this host lacks a capability, and so do its privileged containers: $bounding of $all"
        install -m 755 "$folder/engine/runc.py" "$run/runc"
        runtime="--add-runtime host=$run/runc --default-runtime host"
    fi
    rm -rf "$work/data"
    # shellcheck disable=SC2086 # words on purpose
    setsid dockerd --config-file "$run/daemon.json" --host "unix://$run/sock" --pidfile "$run/pid" --exec-root "$run/exec" \
        --data-root "$work/data" --containerd-namespace "${run##*/}" --containerd-plugins-namespace "${run##*/}-plugins" \
        --exec-opt native.cgroupdriver=cgroupfs --bridge none --iptables=false --ip6tables=false $runtime >"$work/dockerd.log" 2>&1 9>&- &
    engine=$!
    export DOCKER_HOST="unix://$run/sock"
    # The builder that the engine has by itself; the newer one is a plugin of the client.
    export DOCKER_BUILDKIT=0
    for _ in $(seq 120); do
        ! docker info >/dev/null 2>&1 || return 0
        kill -0 $engine 2>/dev/null || break
        sleep 0.5
    done
    cat "$work/dockerd.log" >&2
    fail "dockerd does not start"
}

# Ends the engine with all that it has started, and removes what it has made; the base images' file systems stay.
engine_stop() {
    [ -n "${engine:-}" ] || return 0
    if kill -0 "$engine" 2>/dev/null; then
        # shellcheck disable=SC2046 # words on purpose
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

# quietly COMMAND…: its output only if it fails.
quietly() {
    "$@" >"$work/log" 2>&1 || {
        cat "$work/log" >&2
        fail "$*"
    }
}

# base_image TAG: an image of Debian's, made from its packages. What the slim images leave out of minbase is documents.
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

# made TAG: an image of the Dockerfile that comes in, and of the files that lie in $work/context, which go.
made() {
    cat >"$work/context/Dockerfile"
    quietly docker build --network host --tag "$1" "$work/context"
    rm -rf "$work/context"
    mkdir "$work/context"
}

# rust_image TAG BASE: with the toolchain of this host, and whom it trusts: its way to crates.io may lead through a proxy.
rust_image() {
    sysroot=$(rustc --print sysroot)
    mkdir "$work/context/rust"
    for part in bin lib libexec; do
        [ ! -d "$sysroot/$part" ] || cp -a "$sysroot/$part" "$work/context/rust"
    done
    rm -rf "$work/context/rust/lib/rustlib/src"
    cp -L /etc/ssl/certs/ca-certificates.crt "$work/context"
    made "$1" <<END
FROM $2
RUN apt-get update && apt-get install -y --no-install-recommends build-essential ca-certificates && rm -rf /var/lib/apt/lists/*
COPY rust /usr/local
COPY ca-certificates.crt /etc/ssl/certs/ca-certificates.crt
END
}
