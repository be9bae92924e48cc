#!/bin/sh
# Tests the server's and the worker's image without a container engine: runs each step of docker/Dockerfile in a folder, and
# starts the result in namespaces, like a privileged container, with the configurations of docker/compose.yaml and
# docker/kubernetes/.
#
#   TARGET_DIR=target docker/test-box.sh         (as root, after cargo build --bins; docker/setup.sh box)
#   TARGET_DIR=target docker/test-box.sh start   (start the images of an earlier call)
#
# The program is the one built on this host, not in the Dockerfile's first stage. On a host with cgroup v1 the entry point runs
# the program as root; `make test-cgroup2` tests v2.
set -eu
: "${TARGET_DIR:=target}"
repository=$(dirname "$(dirname "$(realpath "$0")")")
program=$(realpath "$TARGET_DIR/debug/faceoff")
work=$(mkdir -p "$TARGET_DIR/box" && realpath "$TARGET_DIR/box")
dockerfile=$repository/docker/Dockerfile
fail() {
    echo "error: $*" >&2
    exit 1
}
[ "$(id -u)" -eq 0 ] || fail "run it as root: it creates root file systems"

# Starts outside of the image and changes into it, so that the image needs no program of the host.
cat >"$work/enter" <<'END'
#!/bin/sh
# enter ROOT COMMAND…: runs a command like a privileged container, in the current namespaces.
set -eu
root=$1
shift
mount --bind "$root" "$root"
mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
if [ -e /sys/fs/cgroup/cgroup.controllers ]; then
    mount -t sysfs sys "$root/sys"
    mount -t cgroup2 cgroup2 "$root/sys/fs/cgroup"
else
    mount --rbind /sys "$root/sys"
fi
for folder in dev/shm tmp run; do
    mount -t tmpfs -o mode=1777 memory "$root/$folder"
done
# Host names of the other services in Compose and Kubernetes.
echo '127.0.0.1 localhost nats server faceoff' >"$root/run/hosts"
touch "$root/etc/hosts"
mount --bind "$root/run/hosts" "$root/etc/hosts"
if [ -n "${BOX_CONFIG:-}" ]; then
    mkdir -p "$root/etc/faceoff"
    mount --bind "$BOX_CONFIG" "$root/etc/faceoff"
fi
# A program in a chroot cannot create user namespaces.
mkdir -p "$root/old"
cd "$root"
pivot_root . old
umount -l /old
rmdir /old
cd /
exec env -i PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin ${FACEOFF_CONFIG:+FACEOFF_CONFIG="$FACEOFF_CONFIG"} "$@"
END
chmod 755 "$work/enter"
# box ROOT COMMAND…: runs a command in a new control group and new namespaces, with the caller's network. As in a container, the group
# contains no process from outside of the PID namespace.
box() {
    # shellcheck disable=SC2016 # expanded by the inner shell
    unshare --pid --fork --kill-child sh -c '
        if [ -e /sys/fs/cgroup/cgroup.controllers ]; then
            group=$(mktemp -d /sys/fs/cgroup/faceoff-box-XXXXXX) && echo 0 >"$group/cgroup.procs"
        fi
        exec unshare --mount --cgroup --ipc --uts "$@"' sh "$work/enter" "$@"
}

# Runs server, worker and NATS with one set of configurations, in a separate network.
run_services() {
    kind=$1
    entrypoint=$(cat "$work/base.ENTRYPOINT")
    ip link set lo up
    rm -rf "$work/streams" "$work/run" "$work/server/data"
    install -d -o 990 -g 990 -m 0700 "$work/server/data"
    mkdir "$work/streams" "$work/run"
    sed "s,/var/lib/nats,$work/streams," "$work/$kind/nats-server.conf" >"$work/run/nats.conf"
    nats-server --config "$work/run/nats.conf" >"$work/run/nats" 2>&1 &
    export BOX_CONFIG="$work/$kind"
    # shellcheck disable=SC2046 # CMD is split into words
    FACEOFF_CONFIG=/etc/faceoff/faceoff.toml box "$work/server" "$entrypoint" $(cat "$work/server.CMD") >"$work/run/server" 2>&1 &
    # shellcheck disable=SC2046
    FACEOFF_CONFIG=/etc/faceoff/worker.toml box "$work/worker" "$entrypoint" $(cat "$work/worker.CMD") >"$work/run/worker" 2>&1 &
    answers=''
    for _ in $(seq 120); do
        sleep 1
        answers=$(for path in livez readyz; do
            curl --silent --output /dev/null --write-out '%{http_code} ' "http://127.0.0.1:8080/$path" || true
        done)
        if [ "$answers" = '200 200 ' ] && grep -q 'connected to NATS' "$work/run/worker"; then
            # A free slot requests a job from the server. It retries after some seconds if the server was not ready.
            sleep 10
            errors=$(grep -c ERROR "$work/run/worker" || true)
            sleep 10
            if grep ERROR "$work/run/server" || [ "$(grep -c ERROR "$work/run/worker" || true)" != "$errors" ]; then
                cat "$work/run/worker" >&2
                echo "error: $kind: requests between server and worker fail" >&2
                return 1
            fi
            echo "$kind: the server answers /livez and /readyz, and the worker requests jobs"
            return 0
        fi
    done
    cat "$work/run/server" "$work/run/worker" "$work/run/nats" >&2
    echo "error: $kind: /livez and /readyz answered ${answers:-nothing}, or the worker did not connect" >&2
    return 1
}
if [ "${1:-}" = run-services ]; then
    run_services "$2"
    exit
fi

# schema PROGRAM …: runs it with its interpreter, since a path with a space does not work in a program's first line.
schema() {
    checker=$1
    shift
    "$work/schemas/bin/python" "$work/schemas/bin/$checker" "$@"
}
# Checks the files for other engines against their schemas.
[ -x "$work/schemas/bin/kubernetes-validate" ] || {
    python3 -m venv "$work/schemas"
    "$work/schemas/bin/python" -m pip install --quiet check-jsonschema==0.39.0 kubernetes-validate==1.37.0 pyyaml
}
schema check-jsonschema --builtin-schema vendor.compose-spec "$repository/docker/compose.yaml"
schema kubernetes-validate --strict --quiet "$repository"/docker/kubernetes/*.yaml
echo "the files match the schemas of Compose and Kubernetes"
# Extracts their configurations to compose/ and kubernetes/, and checks that every path in compose.yaml exists.
"$work/schemas/bin/python" - "$repository/docker" "$work" <<'END'
import pathlib, sys, yaml
docker, work = map(pathlib.Path, sys.argv[1:])
compose = yaml.safe_load((docker / "compose.yaml").read_text())
maps = [part for file in sorted((docker / "kubernetes").glob("*.yaml")) for part in yaml.safe_load_all(file.read_text())
        if part["kind"] == "ConfigMap"]
found = {
    "compose": {name: config["content"] for name, config in compose["configs"].items()},
    "kubernetes": {name: text for part in maps for name, text in part["data"].items()},
}
for kind, files in found.items():
    (work / kind).mkdir(exist_ok=True)
    assert sorted(files) == ["faceoff.toml", "nats-server.conf", "worker.toml"], files.keys()
    for name, text in files.items():
        (work / kind / name).write_text(text)
for name, service in compose["services"].items():
    paths = [volume.split(":")[0] for volume in service.get("volumes", []) if volume.startswith(".")]
    if "build" in service:
        context = docker / service["build"]["context"]
        paths.append(context.relative_to(docker) / service["build"]["dockerfile"])
    for path in paths:
        assert (docker / path).is_file(), f"{name} has the path {path}, which does not exist"
END

# in_root COMMAND: runs a command like a build step, with this host's network.
in_root() {
    # shellcheck disable=SC2016 # expanded by the inner shell
    unshare --mount --pid --fork sh -c '
        set -eu
        mount --bind "$1" "$1"
        mount -t proc proc "$1/proc"
        mount --rbind /dev "$1/dev"
        mount --bind /etc/resolv.conf "$1/etc/resolv.conf"
        exec chroot "$1" /bin/sh -c "$2"' sh "$root" "$1"
}

# image TARGET: creates $work/TARGET by the steps of its stages, and stores ENTRYPOINT and CMD.
image() {
    root=$work/$1
    rm -rf "$root"
    # One step per line, without comments; then the stages from the target back to an external image.
    awk '/^#/ { next } { line = line $0 } /\\$/ { sub(/\\$/, "", line); next } line != "" { print line; line = "" }' "$dockerfile" >"$work/steps"
    stages=$1
    while from=$(awk -v stage="${stages%% *}" '$1 == "FROM" && $4 == stage { print $2 }' "$work/steps") && case $from in *:*) false ;; esac; do
        [ -n "$from" ] || fail "$dockerfile has no stage ${stages%% *}"
        stages="$from $stages"
    done
    suite=${from#debian:}
    [ "$suite" != "$from" ] || fail "this script supports only Debian images, and ${stages%% *} is from $from"
    echo "image $1: $from, then the stages $stages"
    # mmdebstrap needs an empty folder; the slim images are minbase without documentation.
    mmdebstrap --quiet --variant=minbase "${suite%-slim}" "$root" >"$work/log" 2>&1 || {
        cat "$work/log" >&2
        fail "mmdebstrap cannot create $from"
    }
    for stage in $stages; do
        awk -v stage="$stage" '$1 == "FROM" { in_it = $4 == stage; next } in_it' "$work/steps" >"$work/stage"
        while read -r step words; do
            case $step in
            RUN) in_root "$words" </dev/null >"$work/log" 2>&1 || {
                cat "$work/log" >&2
                fail "RUN $words"
            } ;;
            COPY)
                # shellcheck disable=SC2086 # split into words
                set -- $words
                case $1 in
                --from=build)
                    [ "$2" = /src/target/release/faceoff ] || fail "the first stage builds no $2"
                    source=$program
                    shift
                    ;;
                *) source=$repository/$1 ;;
                esac
                [ -e "$source" ] || fail "COPY $words: $source does not exist"
                cp "$source" "$root$2"
                ;;
            ENTRYPOINT | CMD) printf '%s\n' "$words" | tr -d '[]",' >"$work/$stage.$step" ;;
            VOLUME) mkdir -p "$root/$words" ;;
            EXPOSE) [ "$words" = 8080 ] || fail "expected to expose 8080, got $words" ;;
            *) fail "this script does not know the step $step" ;;
            esac
        done <"$work/stage"
    done
}
trap 'find /sys/fs/cgroup/faceoff-box-* -depth -type d -exec rmdir {} + 2>/dev/null || true' EXIT
[ "${1:-}" = start ] || for image in worker server; do
    image "$image"
done

entrypoint=$(cat "$work/base.ENTRYPOINT")
version=$(box "$work/server" "$entrypoint" faceoff --version)
[ "$version" = "$("$program" --version)" ] || fail "expected the version of $program, got $version"
echo "faceoff --version: $version"
for image in server worker; do
    echo "faceoff doctor in the image $image:"
    box "$work/$image" "$entrypoint" faceoff doctor || fail "the sandbox does not work in the image $image"
done

for kind in compose kubernetes; do
    unshare --net --pid --fork --kill-child --mount-proc "$0" run-services "$kind"
done
echo "the images start, and their services work"
