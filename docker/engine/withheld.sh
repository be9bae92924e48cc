# Sourced by docker/test-engine.sh: what a container lacks is named, by the entry point and by doctor.
# shellcheck shell=sh
: "${work:?}" "${run:?}" "${folder:?}"
#
# doctor_in OPTIONS…: doctor in a container with these; its status is kept, and what it and the entry point say.
doctor_in() {
    status=0
    docker run --rm --network none "$@" faceoff faceoff doctor >"$work/doctor" 2>&1 || status=$?
}
# told STATUS PATTERN…: that doctor ended so, and said each of these.
told() {
    what=$1
    [ "$status" = "$2" ] || {
        cat "$work/doctor" >&2
        fail "$what: expected doctor to end with status $2, and it ended with $status"
    }
    shift 2
    for pattern in "$@"; do
        grep -Eq -- "$pattern" "$work/doctor" || {
            cat "$work/doctor" >&2
            fail "$what: doctor does not say: $pattern"
        }
    done
    missing=$(awk '$1 == "MISSING" { print $2 }' "$work/doctor" | xargs)
    echo "doctor, $what: ${missing:-nothing} missing"
}
# Words of a list, so from a folder whose path has no space.
cp "$folder/seccomp.json" "$run/seccomp.json"
confined="--security-opt apparmor=unconfined --security-opt seccomp=$run/seccomp.json"
no_groups='entrypoint: agents cannot be bounded here: .* read-only: .*docker run --privileged'

doctor_in
told 'by default' 1 "$no_groups" 'MISSING +namespaces .*namespace' 'in Docker: .*--security-opt seccomp' \
    'MISSING +cgroup-memory .*Read-only' 'MISSING +cgroup-pids' 'MISSING +cgroup-cpu' 'in Docker: docker run --privileged'
# shellcheck disable=SC2086 # words on purpose
doctor_in $confined
told 'with our seccomp profile and a masked /proc' 1 "$no_groups" "MISSING +namespaces .*mount proc" \
    '-> provide a /proc without masked files, .*systempaths=unconfined'
# shellcheck disable=SC2086
doctor_in $confined --security-opt systempaths=unconfined
told 'with our seccomp profile and a whole /proc' 1 "$no_groups" 'ok +namespaces' 'ok +seccomp' 'MISSING +cgroup-memory' \
    'given_up = \["cgroup-memory", "cgroup-pids", "cgroup-cpu"\]'
[ "$missing" = "cgroup-memory cgroup-pids cgroup-cpu" ] || fail "more is missing than control groups"
doctor_in --privileged --cgroupns private
told privileged 0 'ok +namespaces' 'ok +seccomp' 'ok +cgroup-memory' 'ok +cgroup-pids' 'ok +cgroup-cpu' 'ok +rlimits'
doctor_in --privileged --cgroupns private --security-opt "seccomp=$folder/seccomp.json"
told 'privileged, with our seccomp profile' 0 'ok +namespaces' 'ok +seccomp' 'ok +cgroup-memory' 'ok +cgroup-pids' 'ok +cgroup-cpu'

# Without control groups, which the configuration then has to say, an agent plays all the same.
cat >"$work/unbounded.toml" <<END
[sandbox]
given_up = ["cgroup-memory", "cgroup-pids", "cgroup-cpu"]
END
# shellcheck disable=SC2086
quietly docker run --rm --network none $confined --security-opt systempaths=unconfined --volume "$work/ours.tar:/ours.tar:ro" \
    --volume "$work/unbounded.toml:/unbounded.toml:ro" faceoff faceoff eval /ours.tar --config /unbounded.toml --episodes 1 --out /data/eval
echo "an agent plays in a container with our seccomp profile that is not privileged, without limits of memory, processes and CPU time"

# What the profile refuses is refused; and the question tells something, for without any profile it is let through.
refused_in() { docker run --rm --interactive --network none "$@" ours:latest python3 - <"$folder/engine/refused.py"; }
# shellcheck disable=SC2086
refused_in $confined || fail "the seccomp profile lets through what it should refuse, or refuses what bubblewrap needs"
! refused_in --privileged >"$work/log" || fail "nothing is let through without a profile, which says that the calls are wrong"
# shellcheck disable=SC2086
if refused_in --privileged $confined >/dev/null; then
    echo "seccomp profile: applied, and to a privileged container, too"
else
    echo "seccomp profile: applied, but by this engine not to a privileged container"
fi
