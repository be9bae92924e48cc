#!/bin/sh
# Tests the images with Docker: builds docker/Dockerfile, starts server, NATS and two workers as in docker/compose.yaml, runs a day with an
# agent in a container image, and checks the reports about missing features in containers that are not privileged.
#
#   TARGET_DIR=target docker/test-engine.sh            (as root, after cargo build --bins; docker/setup.sh engine)
#   WHOLE=1 TARGET_DIR=target docker/test-engine.sh    (also the Dockerfile's first stage, which compiles the program)
#
# It uses a separate engine (docker/engine/start.sh), which is removed at the end. The base images are built from Debian's packages, so
# that no image is fetched from a registry. docker/engine/service.py reads compose.yaml instead of the Compose program. Only the internal
# network is used, and this host is in it too.
set -eu
: "${TARGET_DIR:=target}" "${WHOLE:=}"
folder=$(dirname "$(realpath "$0")")
repository=$(dirname "$folder")
program=$(realpath "$TARGET_DIR/debug/faceoff")
work=$(mkdir -p "$TARGET_DIR/engine" && realpath "$TARGET_DIR/engine")
fail() {
    echo "error: $*" >&2
    exit 1
}
[ "$(id -u)" -eq 0 ] || fail "run it as root: it starts an engine"
# Stopping takes a while, since the engine's data are removed.
exec 9>"$work/lock"
flock --nonblock 9 || fail "another run uses $work"
# shellcheck source=docker/engine/start.sh
. "$folder/engine/start.sh"
trap engine_stop EXIT
trap 'exit 1' INT TERM
rm -rf "$work/context" "$work/configs" "$work/evals"
mkdir -p "$work/context" "$work/evals"
engine_start
echo "engine: $(docker version --format 'Docker {{.Server.Version}}'), cgroup v$(docker info --format '{{.CgroupVersion}}')"

# The images, with the names in compose.yaml and the Dockerfile.
debian=$(awk '$1 == "FROM" && $4 == "base" { print $2 }' "$folder/Dockerfile")
base_image "$debian"
if [ -n "$WHOLE" ]; then
    rust_image "$(awk '$1 == "FROM" && $4 == "build" { print $2 }' "$folder/Dockerfile")" "$debian"
    cp "$folder/Dockerfile" "$work/Dockerfile"
else
    # Replace the first stage by the built program; the rest of the file is unchanged.
    cp "$program" "$work/context/faceoff"
    build_image faceoff-built <<END
FROM scratch
COPY faceoff /src/target/release/faceoff
END
    awk '$1 == "FROM" && $4 == "build" { print "FROM faceoff-built AS build"; skip = 1; next } $1 == "FROM" { skip = 0 } !skip' \
        "$folder/Dockerfile" >"$work/Dockerfile"
fi
began=$(date +%s)
quietly docker build --network host --file "$work/Dockerfile" --target worker --tag faceoff-worker "$repository"
quietly docker build --network host --file "$work/Dockerfile" --target server --tag faceoff "$repository"
echo "images: built in $(($(date +%s) - began)) s, $([ -n "$WHOLE" ] && echo 'with the program' || echo 'from an existing program')"
if [ -n "$WHOLE" ]; then
    # This host and the containers must use the same program.
    docker create --name copied faceoff >/dev/null
    quietly docker cp copied:/usr/local/bin/faceoff "$work/faceoff"
    program=$work/faceoff
fi
build_image nats:2 <<END
FROM $debian
RUN apt-get update && apt-get install -y --no-install-recommends nats-server && rm -rf /var/lib/apt/lists/*
ENTRYPOINT ["nats-server"]
END

# An agent in a container image, as a team would build it.
cp "$repository"/agents/hold/* "$work/context"
sed -i 's/^runtime = .*/runtime = "image"/' "$work/context/agent.toml"
build_image test-agent:latest <<END
FROM $debian
RUN apt-get update && apt-get install -y --no-install-recommends python3 && rm -rf /var/lib/apt/lists/*
COPY . /agent
END
docker save --output "$work/agent.tar" test-agent:latest
# Another user reads the file in a container.
chmod 644 "$work/agent.tar"

# shellcheck source=docker/engine/missing_features.sh
. "$folder/engine/missing_features.sh"
# shellcheck source=docker/engine/day.sh
. "$folder/engine/day.sh"
# shellcheck source=docker/engine/saved_images.sh
. "$folder/engine/saved_images.sh"
echo "server, workers and agents run in containers of a real engine"
