#!/bin/sh
# Checks a release program before its publication: its size, that it has no symbols, and that its simulator gives the golden hashes
# (those of fixed episodes and games, stored in the repository). Reports all defects, not only the first.
# usage: check-program.sh PROGRAM      (PROGRAM: for example target/release/faceoff)
set -eu
if [ $# -ne 1 ]; then
    echo "usage: $0 PROGRAM" >&2
    exit 2
fi
program=$(realpath "$1")
golden=$(dirname "$(dirname "$(realpath "$0")")")/tests/golden/simulator.txt
# Limit for growth by dependencies and generic code; defined only here (docs/contributing/building.md).
most_bytes=40000000

has_defect=''
refuse() {
    echo "error: $program $*" >&2
    has_defect=yes
}

if ! sections=$(LC_ALL=C readelf --sections --wide "$program" 2>/dev/null); then
    echo "error: $program is no ELF program; give the one that \`cargo build --release --package faceoff\` has built" >&2
    exit 1
fi
surplus=$(printf '%s\n' "$sections" | grep -oE ' \.(symtab|z?debug_[a-z_]+)' | tr -d '\n' || true)
if [ -n "$surplus" ]; then
    refuse "has sections for debuggers:$surplus. Set \`strip = \"symbols\"\` in [profile.release] of Cargo.toml, and have no" \
        "[profile.release.package.faceoff]: with it, cargo does not strip the program. \`cargo build --profile symbols\` is for debuggers"
fi
bytes=$(wc -c <"$program")
if [ "$bytes" -gt "$most_bytes" ]; then
    refuse "has $bytes bytes, at most $most_bytes are allowed. \`make costs ONLY=release,crates\` lists its sections" \
        "and docs/contributing/building.md says how its size was reduced; the limit is in docker/check-program.sh"
fi
if ! computed=$("$program" sim golden); then
    refuse "does not run \`faceoff sim golden\`, which prints the hashes of the simulator's golden episodes and games"
elif [ "$computed" != "$(cat "$golden")" ]; then
    printf '%s\n' "$computed" | diff "$golden" - >&2 || true
    refuse "computes other golden hashes (>) than $golden has (<), so its episodes differ from the ruleset's. If \`make test\`" \
        "passes, the release profile or its compiler changes the simulator's arithmetic: undo that. An intended change" \
        "needs a new ruleset"
fi
[ -z "$has_defect" ] || exit 1
echo "$bytes bytes of at most $most_bytes, no symbols, golden hashes as in tests/golden: $program"
