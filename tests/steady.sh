#!/bin/sh
# Runs all tests many times, to find those that fail now and then, on an idle and on a busy machine.
#
#   tests/steady.sh        or `make steady`, which installs what it needs
#
# Builds the tests once. Runs them IDLE times (10) alone, and BUSY times (3) beside
#     stress-ng --cpu 4 --vm 2 --vm-bytes 25%
# without building again. Each finished round adds a line to steady/VERSION/rounds.tsv in the target
# folder, and a file with its output. An interrupted run continues after the last line. To repeat all
# rounds of the same version, remove that folder. Prints a table of all rounds at the end. The status is
# 1 if a test failed in any round.
set -eu

cd "$(dirname "$0")/.."
idle=${IDLE:-10}
busy=${BUSY:-3}
version=$(git describe --always --dirty 2>/dev/null || echo unversioned)
log="${CARGO_TARGET_DIR:-target}/steady/$version"
rounds="$log/rounds.tsv"
mkdir -p "$log"
touch "$rounds"

for tool in cargo-nextest stress-ng python3; do
    command -v "$tool" >/dev/null 2>&1 || {
        echo "error: $tool is missing; run docker/setup.sh steady, and cargo install cargo-nextest --locked" >&2
        exit 1
    }
done

# Builds all programs first, as `make test` does, and then the metadata with which nextest runs them without cargo.
cargo build --locked --workspace --bins --tests
cargo metadata --locked --format-version 1 >"$log/metadata.json"
cargo nextest list --locked --workspace --list-type binaries-only --message-format json >"$log/binaries.json"

load=''
stop_load() {
    [ -z "$load" ] || kill "$load" 2>/dev/null || true
    [ -z "$load" ] || wait "$load" 2>/dev/null || true
    load=''
}
trap stop_load EXIT
trap 'exit 130' INT TERM

run_round() { # run_round ROUND LOAD
    out="$log/round-$1.log"
    started=$(date +%s)
    python3 agents/test_agents.py >"$out" 2>&1 && failed='' || failed=' agents/test_agents.py'
    cargo nextest run --cargo-metadata "$log/metadata.json" --binaries-metadata "$log/binaries.json" \
        --no-fail-fast --color never --status-level fail --final-status-level fail >>"$out" 2>&1 || {
        # FAIL, TIMEOUT, SIGSEGV …: [time] (number) binary test
        names=$(sed -nE '/SLOW/!s/^ *[A-Z]+ \[[^]]*\] *(\([^)]*\) *)?([^ ]+ [^ ]+)$/\2/p' "$out" | sort -u | tr ' \n' ': ')
        failed="$failed ${names:-nextest}"
    }
    passed=$(sed -nE 's/^ *Summary .* ([0-9]+) passed.*/\1/p' "$out" | tail -n 1)
    printf '%s\t%s\t%s\t%s\t%s\n' "$1" "$2" "${passed:-0}" "$(($(date +%s) - started))" "${failed:- -}" >>"$rounds"
    tail -n 1 "$rounds"
}

round=0
while [ "$round" -lt $((idle + busy)) ]; do
    round=$((round + 1))
    if cut -f 1 "$rounds" | grep -qx "$round"; then
        continue
    fi
    if [ "$round" -le "$idle" ]; then
        run_round "$round" idle
    else
        stress-ng --cpu 4 --vm 2 --vm-bytes 25% --quiet &
        load=$!
        run_round "$round" busy
        stop_load
    fi
done

echo
{
    printf 'round\tload\tpassed\tseconds\tfailed\n'
    sort -n "$rounds"
} | column -t -s "$(printf '\t')"
! cut -f 5 "$rounds" | grep -qvx ' -'
