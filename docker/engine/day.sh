# Sourced by docker/test-engine.sh: an evaluation day in containers, controlled from outside by API and command line.
# shellcheck shell=sh
: "${work:?}" "${folder:?}" "${repository:?}" "${program:?}"

# is_true CONDITION PATH: is a Python condition true for the server's answer `a` to a GET of the path?
is_true() {
    curl --silent --show-error --fail --noproxy '*' --max-time 20 --header "Authorization: Bearer $FACEOFF_ADMIN_TOKEN" \
        "$FACEOFF_SERVER$2" >"$work/answer" 2>"$work/log" &&
        python3 -c 'import json, sys; a = json.load(open(sys.argv[1])); sys.exit(not eval(sys.argv[2]))' "$work/answer" "$1"
}
# wait_until SECONDS CONDITION PATH: waits until the condition is true, at most so many seconds.
wait_until() {
    ends=$(($(date +%s) + $1))
    until is_true "$2" "$3"; do
        [ "$(date +%s)" -lt "$ends" ] || {
            for container in nats server worker-1 worker-2; do
                echo "--- $container" && docker logs --tail 30 $container
            done >&2
            cat "$work/answer" "$work/log" >&2
            fail "$3: after $1 s still not: $2"
        }
        sleep 1
    done
}
# start_service SERVICE [ADDITION]: as in compose.yaml, with the file ADDITION appended to its configuration.
start_service() {
    python3 "$folder/engine/service.py" "$1" "$work/configs" ${2:+"$2"} >"$work/words"
    set --
    while read -r word; do
        set -- "$@" "$word"
    done <"$work/words"
    quietly docker run --detach "$@"
}

# This host may have fewer CPUs than the file assigns, and no time is measured.
SERVER_CPUS=0-$(($(nproc) - 1))
export SERVER_CPUS WORKER_1_CPUS="$SERVER_CPUS" WORKER_2_CPUS="$SERVER_CPUS"
# A short day with enough shards for both workers, without time limits that a busy machine could exceed.
{
    cat "$repository/tests/long_time_limits.toml"
    printf '[evaluation]\nepisodes_per_task = 4\nepisodes_per_shard = 1\n'
} >"$work/short.toml"
quietly docker network create --internal work
start_service nats
start_service server "$work/short.toml"
start_service worker-1
start_service worker-2
FACEOFF_SERVER=http://$(docker inspect --format '{{.NetworkSettings.Networks.work.IPAddress}}' server):8080
FACEOFF_ADMIN_TOKEN=''
export FACEOFF_SERVER FACEOFF_ADMIN_TOKEN
for _ in $(seq 120); do
    ! FACEOFF_ADMIN_TOKEN=$(docker exec server cat /data/admin-token 2>/dev/null) || break
    sleep 0.5
done
[ -n "$FACEOFF_ADMIN_TOKEN" ] || fail "the server has not written its token: $(docker logs server 2>&1)"
wait_until 120 'sorted(w["name"] for w in a["workers"] if w["state"] == "idle") == ["worker-1", "worker-2"]' /api/v1/workers
wait_until 60 True /readyz
echo "server, NATS and two workers are ready in containers"

team_token=$("$program" admin --json create-team Contained | python3 -c 'import json, sys; print(json.load(sys.stdin)["token"])')
quietly env FACEOFF_TOKEN="$team_token" "$program" submit "$work/agent.tar"
evaluation=/api/v1/evaluations/$("$program" admin --json start-day |
    python3 -c 'import json, sys; [created] = json.load(sys.stdin)["created"]; print(created["id"])')
wait_until 300 'a["state"] not in ("queued", "running", "finalising")' "$evaluation"
is_true 'a["state"] == "finished" and [t["episodes"] for t in a["result"]["tasks"].values()] == [4] * 3 and a["result"]["score"] >= 0' "$evaluation" || {
    cat "$work/answer" >&2
    fail "the evaluation of an image is not finished with a score"
}
for worker in worker-1 worker-2; do
    docker logs $worker >"$work/log" 2>&1
    played=$(grep -c 'committed' "$work/log" || true)
    [ "$played" -gt 0 ] || {
        cat "$work/log" >&2
        fail "$worker has run no shard"
    }
    echo "$worker has run $played shards"
done
! docker logs server 2>&1 | grep -E 'ERROR|committed.*work=(hit|defend|prepare) ' || fail "the server has errors in its log, or ran shards itself"

# SIGTERM must suffice: a container that is killed after the grace period ends with status 137.
for container in worker-1 worker-2 server nats; do
    began=$(date +%s)
    quietly docker stop $container
    status=$(docker inspect --format '{{.State.ExitCode}}' $container)
    # NATS ends with status 1 on SIGTERM.
    [ "$status" = 0 ] || [ "$container $status" = 'nats 1' ] || {
        docker logs --tail 30 $container >&2
        fail "$container ended with status $status on SIGTERM"
    }
    echo "$container ends on SIGTERM with status $status in $(($(date +%s) - began)) s"
done
