# Sourced by docker/test-engine.sh: entry point and doctor report the features that a container lacks.
# shellcheck shell=sh
: "${work:?}" "${run:?}" "${folder:?}"

# doctor_in OPTIONS…: runs doctor in a container with these options; stores its status and the output.
doctor_in() {
    status=0
    docker run --rm --network none "$@" faceoff faceoff doctor >"$work/doctor" 2>&1 || status=$?
}
# assert_doctor NAME STATUS PATTERN…: doctor ended with this status, and its output matches each pattern.
assert_doctor() {
    name=$1
    [ "$status" = "$2" ] || {
        cat "$work/doctor" >&2
        fail "$name: expected doctor to end with status $2, got $status"
    }
    shift 2
    for pattern in "$@"; do
        grep -Eq -- "$pattern" "$work/doctor" || {
            cat "$work/doctor" >&2
            fail "$name: doctor does not print: $pattern"
        }
    done
    missing=$(awk '$1 == "MISSING" { print $2 }' "$work/doctor" | xargs)
    echo "doctor, $name: ${missing:-nothing} missing"
}
# Split into words below, so copied to a folder whose path has no space.
cp "$folder/seccomp.json" "$run/seccomp.json"
confined="--security-opt apparmor=unconfined --security-opt seccomp=$run/seccomp.json"
no_groups='entrypoint: agents cannot be bounded here: .* read-only: .*docker run --privileged'

doctor_in
assert_doctor 'by default' 1 "$no_groups" 'MISSING +namespaces .*namespace' 'in Docker: .*--security-opt seccomp' \
    'MISSING +cgroup-memory .*Read-only' 'MISSING +cgroup-pids' 'MISSING +cgroup-cpu' 'in Docker: docker run --privileged'
# shellcheck disable=SC2086 # split into words
doctor_in $confined
assert_doctor 'with the seccomp profile and a masked /proc' 1 "$no_groups" "MISSING +namespaces .*mount proc" \
    '-> provide a /proc without masked files, .*systempaths=unconfined'
# shellcheck disable=SC2086
doctor_in $confined --security-opt systempaths=unconfined
assert_doctor 'with the seccomp profile and a full /proc' 1 "$no_groups" 'ok +namespaces' 'ok +seccomp' 'MISSING +cgroup-memory' \
    'given_up = \["cgroup-memory", "cgroup-pids", "cgroup-cpu"\]'
[ "$missing" = "cgroup-memory cgroup-pids cgroup-cpu" ] || fail "expected only control groups to be missing, got: $missing"
doctor_in --privileged --cgroupns private
assert_doctor privileged 0 'ok +namespaces' 'ok +seccomp' 'ok +cgroup-memory' 'ok +cgroup-pids' 'ok +cgroup-cpu' 'ok +rlimits'
doctor_in --privileged --cgroupns private --security-opt "seccomp=$folder/seccomp.json"
assert_doctor 'privileged, with the seccomp profile' 0 'ok +namespaces' 'ok +seccomp' 'ok +cgroup-memory' 'ok +cgroup-pids' 'ok +cgroup-cpu'

# Without control groups, which the configuration must then state, agents run too.
cat >"$work/unbounded.toml" <<END
[sandbox]
given_up = ["cgroup-memory", "cgroup-pids", "cgroup-cpu"]
END
# shellcheck disable=SC2086
quietly docker run --rm --network none $confined --security-opt systempaths=unconfined --volume "$work/agent.tar:/agent.tar:ro" \
    --volume "$work/unbounded.toml:/unbounded.toml:ro" faceoff faceoff eval /agent.tar --config /unbounded.toml --episodes 1 --out /data/eval
echo "an agent runs in a container with the seccomp profile, not privileged, without limits of memory, processes and CPU time"

# The profile refuses its calls. Without a profile they are allowed, which shows that the test calls are valid.
refused_in() { docker run --rm --interactive --network none "$@" test-agent:latest python3 - <"$folder/engine/refused.py"; }
# shellcheck disable=SC2086
refused_in $confined || fail "the seccomp profile allows a call that it should refuse, or refuses one that bubblewrap needs"
! refused_in --privileged >"$work/log" || fail "all calls are refused without a profile, so the test calls are wrong"
# shellcheck disable=SC2086
if refused_in --privileged $confined >/dev/null; then
    echo "seccomp profile: applied, also to a privileged container"
else
    echo "seccomp profile: applied, but this engine does not apply it to a privileged container"
fi
