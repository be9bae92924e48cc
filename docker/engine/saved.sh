# Sourced by docker/test-engine.sh: the same image as several programs save it plays the same episodes with the same outcome.
# shellcheck shell=sh
: "${work:?}" "${run:?}" "${repository:?}" "${program:?}"
#
# same_as_first NAME ARCHIVE: what an evaluation on this host says of it, but for times.
same_as_first() {
    quietly "$program" eval "$2" --episodes 2 --seed 0 --config "$repository/tests/patient.toml" --out "$work/evals/$1"
    python3 - "$work/evals/$1/results.json" "$work/evals/first" <<'END' || fail "$1 has another outcome than the first"
import json, pathlib, sys
found = json.loads(pathlib.Path(sys.argv[1]).read_text())
del found["timing"]
# An agent is late on a machine that is busy, which costs points.
for part in found, *found["tasks"].values():
    del part["penalty_points"], part["tier"]
for task in found["tasks"].values():
    del task["computation_time_s"], task["violations"]["computation_time"]
first = pathlib.Path(sys.argv[2])
if not first.exists():
    first.write_text(json.dumps(found))
sys.exit(json.loads(first.read_text()) != found)
END
    echo "image as of $1: $(python3 -c 'import json, sys; print("score", json.load(open(sys.argv[1]))["score"])' "$work/evals/first")"
    rm -f "$2"
}
quietly docker save --output "$work/again.tar" ours:latest
same_as_first docker-save "$work/again.tar"
gzip -1 <"$work/ours.tar" >"$work/ours.tar.gz"
same_as_first docker-save-gzip "$work/ours.tar.gz"
for kind in docker oci; do
    quietly skopeo copy --quiet "docker-daemon:ours:latest" --src-daemon-host "$DOCKER_HOST" "$kind-archive:$work/skopeo.tar:ours:latest"
    same_as_first "skopeo-$kind-archive" "$work/skopeo.tar"
done
# Two layers that are the same, of which Docker writes one as a link to the other, and one that removes what the first had.
cp "$repository"/agents/hold/* "$work/context"
sed -i 's/^runtime = .*/runtime = "image"/' "$work/context/agent.toml"
echo twice >"$work/context/twice"
touch --date '2026-01-01' "$work/context/twice"
made ours:twice <<END
FROM ours:latest
COPY twice /twice
RUN rm /twice /agent/README.md
COPY twice /twice
END
quietly docker save --output "$work/twice.tar" ours:twice
tar --list --verbose --file "$work/twice.tar" | grep -q 'layer.tar ->' || echo "this Docker saves layers that are the same without links"
same_as_first two-layers-that-are-the-same "$work/twice.tar"
# Podman's own store, which is none of the engine's.
if command -v podman >/dev/null; then
    podman_in() { podman --root "$work/podman" --runroot "$run/podman" --storage-driver vfs "$@"; }
    quietly podman_in load --input "$work/ours.tar"
    for kind in docker oci; do
        quietly podman_in save --format $kind-archive --output "$work/podman.tar" ours:latest
        same_as_first "podman-$kind-archive" "$work/podman.tar"
    done
    podman_in rmi --all --force >/dev/null 2>&1 || true
    rm -rf "$work/podman"
fi
