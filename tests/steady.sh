#!/bin/sh
# Do the verdicts hold, round after round, on an idle machine and on a busy one?
#
#   tests/steady.sh        or `make steady`, which installs what it needs
#
# Builds the tests once and runs them IDLE times (10) by themselves and BUSY times (3) beside
#     stress-ng --cpu 4 --vm 2 --vm-bytes 25%
# without building again. Each finished round is a line of steady/VERSION/rounds.tsv below the target
# folder, its whole output a file beside it; a run that was interrupted goes on after the last line.
# For another set of rounds of the same version, remove that folder. Ends with a table of all rounds,
# and with status 1 if a test failed in any of them.
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

# All programs first, as in `make test`; then what nextest needs to run them without cargo.
cargo build --locked --workspace --bins --tests
cargo metadata --locked --format-version 1 >"$log/metadata.json"
cargo nextest list --locked --workspace --list-type binaries-only --message-format json >"$log/binaries.json"

load=''
unload() {
    [ -z "$load" ] || kill "$load" 2>/dev/null || true
    [ -z "$load" ] || wait "$load" 2>/dev/null || true
    load=''
}
trap unload EXIT
trap 'exit 130' INT TERM

play() { # play ROUND LOAD
    out="$log/round-$1.log"
    begun=$(date +%s)
    python3 agents/test_agents.py >"$out" 2>&1 && failed='' || failed=' agents/test_agents.py'
    cargo nextest run --cargo-metadata "$log/metadata.json" --binaries-metadata "$log/binaries.json" \
        --no-fail-fast --color never --status-level fail --final-status-level fail >>"$out" 2>&1 || {
        # FAIL, TIMEOUT, SIGSEGV …: [time] (number) binary test
        names=$(sed -nE '/SLOW/!s/^ *[A-Z]+ \[[^]]*\] *(\([^)]*\) *)?([^ ]+ [^ ]+)$/\2/p' "$out" | sort -u | tr ' \n' ': ')
        failed="$failed ${names:-nextest}"
    }
    passed=$(sed -nE 's/^ *Summary .* ([0-9]+) passed.*/\1/p' "$out" | tail -n 1)
    printf '%s\t%s\t%s\t%s\t%s\n' "$1" "$2" "${passed:-0}" "$(($(date +%s) - begun))" "${failed:- -}" >>"$rounds"
    tail -n 1 "$rounds"
}

round=0
while [ "$round" -lt $((idle + busy)) ]; do
    round=$((round + 1))
    if cut -f 1 "$rounds" | grep -qx "$round"; then
        continue
    fi
    if [ "$round" -le "$idle" ]; then
        play "$round" idle
    else
        stress-ng --cpu 4 --vm 2 --vm-bytes 25% --quiet &
        load=$!
        play "$round" busy
        unload
    fi
done

echo
{
    printf 'round\tload\tpassed\tseconds\tfailed\n'
    sort -n "$rounds"
} | column -t -s "$(printf '\t')"
! cut -f 5 "$rounds" | grep -qvx ' -'
