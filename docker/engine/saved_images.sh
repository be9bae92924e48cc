# Sourced by docker/test-engine.sh: the same image, saved by several programs, gives the same outcome in the same episodes.
# shellcheck shell=sh
: "${work:?}" "${run:?}" "${repository:?}" "${program:?}"

# same_as_first NAME ARCHIVE: compares the results of an evaluation on this host, without times, with the first ones.
same_as_first() {
    quietly "$program" eval "$2" --episodes 2 --seed 0 --config "$repository/tests/long_time_limits.toml" --out "$work/evals/$1"
    python3 - "$work/evals/$1/results.json" "$work/evals/first" <<'END' || fail "$1 has a different outcome from the first"
import json, pathlib, sys
found = json.loads(pathlib.Path(sys.argv[1]).read_text())
del found["timing"]
# On a busy machine agents may be late, which costs points.
for part in found, *found["tasks"].values():
    del part["penalty_points"], part["tier"]
for task in found["tasks"].values():
    del task["computation_time_s"], task["violations"]["computation_time"]
first = pathlib.Path(sys.argv[2])
if not first.exists():
    first.write_text(json.dumps(found))
sys.exit(json.loads(first.read_text()) != found)
END
    echo "image from $1: $(python3 -c 'import json, sys; print("score", json.load(open(sys.argv[1]))["score"])' "$work/evals/first")"
    rm -f "$2"
}
quietly docker save --output "$work/again.tar" test-agent:latest
same_as_first docker-save "$work/again.tar"
gzip -1 <"$work/agent.tar" >"$work/agent.tar.gz"
same_as_first docker-save-gzip "$work/agent.tar.gz"
for kind in docker oci; do
    quietly skopeo copy --quiet "docker-daemon:test-agent:latest" --src-daemon-host "$DOCKER_HOST" "$kind-archive:$work/skopeo.tar:test-agent:latest"
    same_as_first "skopeo-$kind-archive" "$work/skopeo.tar"
done
# Two identical layers, of which Docker writes one as a link to the other, and a layer that removes files of an earlier one.
cp "$repository"/agents/hold/* "$work/context"
sed -i 's/^runtime = .*/runtime = "image"/' "$work/context/agent.toml"
echo twice >"$work/context/twice"
touch --date '2026-01-01' "$work/context/twice"
build_image test-agent:twice <<END
FROM test-agent:latest
COPY twice /twice
RUN rm /twice /agent/README.md
COPY twice /twice
END
quietly docker save --output "$work/twice.tar" test-agent:twice
tar --list --verbose --file "$work/twice.tar" | grep -q 'layer.tar ->' || echo "this Docker saves identical layers without links"
same_as_first two-layers-that-are-the-same "$work/twice.tar"
# Podman's store, separate from the engine's.
if command -v podman >/dev/null; then
    podman_in() { podman --root "$work/podman" --runroot "$run/podman" --storage-driver vfs "$@"; }
    quietly podman_in load --input "$work/agent.tar"
    for kind in docker oci; do
        quietly podman_in save --format $kind-archive --output "$work/podman.tar" test-agent:latest
        same_as_first "podman-$kind-archive" "$work/podman.tar"
    done
    podman_in rmi --all --force >/dev/null 2>&1 || true
    rm -rf "$work/podman"
fi
