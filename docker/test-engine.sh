#!/bin/sh
# Tries the images with Docker itself: builds docker/Dockerfile, starts server, NATS and two workers as docker/compose.yaml says, has them
# play the day of an agent that comes as an image, and looks at what a container lacks that is not privileged.
#
#   TARGET_DIR=target docker/test-engine.sh            (as root, after cargo build --bins; docker/setup.sh engine)
#   WHOLE=1 TARGET_DIR=target docker/test-engine.sh    the Dockerfile's first stage, too, which compiles the program
#
# The engine is one of its own (docker/engine/start.sh), which is gone afterwards. The base images are made from Debian's packages, so that
# nothing is fetched from a registry. Compose's own program is not asked: docker/engine/service.py reads its file. Of its
# networks there is the one without a way out, in which this host is, too.
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
[ "$(id -u)" -eq 0 ] || fail "an engine is started by root"
# Its end takes a while, in which the engine's data go.
exec 9>"$work/lock"
flock --nonblock 9 || fail "another one is at work in $work"
# shellcheck source=docker/engine/start.sh
. "$folder/engine/start.sh"
trap engine_stop EXIT
trap 'exit 1' INT TERM
rm -rf "$work/context" "$work/configs" "$work/evals"
mkdir -p "$work/context" "$work/evals"
engine_start
echo "engine: $(docker version --format 'Docker {{.Server.Version}}'), version $(docker info --format '{{.CgroupVersion}}') of control groups"

# The images, by the names that compose.yaml and the Dockerfile have for them.
debian=$(awk '$1 == "FROM" && $4 == "base" { print $2 }' "$folder/Dockerfile")
base_image "$debian"
if [ -n "$WHOLE" ]; then
    rust_image "$(awk '$1 == "FROM" && $4 == "build" { print $2 }' "$folder/Dockerfile")" "$debian"
    cp "$folder/Dockerfile" "$work/Dockerfile"
else
    # The first stage is taken as done; the rest of the file is as it is.
    cp "$program" "$work/context/faceoff"
    made faceoff-built <<END
FROM scratch
COPY faceoff /src/target/release/faceoff
END
    awk '$1 == "FROM" && $4 == "build" { print "FROM faceoff-built AS build"; skip = 1; next } $1 == "FROM" { skip = 0 } !skip' \
        "$folder/Dockerfile" >"$work/Dockerfile"
fi
began=$(date +%s)
quietly docker build --network host --file "$work/Dockerfile" --target worker --tag faceoff-worker "$repository"
quietly docker build --network host --file "$work/Dockerfile" --target server --tag faceoff "$repository"
echo "images: built in $(($(date +%s) - began)) s, $([ -n "$WHOLE" ] && echo 'the program with them' || echo 'of a program that was built before')"
if [ -n "$WHOLE" ]; then
    # What plays here and there must be one program.
    docker create --name made faceoff >/dev/null
    quietly docker cp made:/usr/local/bin/faceoff "$work/faceoff"
    program=$work/faceoff
fi
made nats:2 <<END
FROM $debian
RUN apt-get update && apt-get install -y --no-install-recommends nats-server && rm -rf /var/lib/apt/lists/*
ENTRYPOINT ["nats-server"]
END

# An agent as a team would make it.
cp "$repository"/agents/hold/* "$work/context"
sed -i 's/^runtime = .*/runtime = "image"/' "$work/context/agent.toml"
made ours:latest <<END
FROM $debian
RUN apt-get update && apt-get install -y --no-install-recommends python3 && rm -rf /var/lib/apt/lists/*
COPY . /agent
END
docker save --output "$work/ours.tar" ours:latest
# Another user reads it in a container.
chmod 644 "$work/ours.tar"

# shellcheck source=docker/engine/withheld.sh
. "$folder/engine/withheld.sh"
# shellcheck source=docker/engine/day.sh
. "$folder/engine/day.sh"
# shellcheck source=docker/engine/saved.sh
. "$folder/engine/saved.sh"
echo "server, workers and agents play in containers of a real engine"
