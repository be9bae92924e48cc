#!/bin/sh
# Creates the runtime python3-ml for tests, and prints its folder: TARGET_DIR/runtimes. If agents cannot see that folder (as below /tmp),
# it uses the user's cache, or else a folder below /var/tmp.
#
#   tests/runtimes.sh TARGET_DIR
set -eu
repository=$(dirname "$(dirname "$(realpath "$0")")")
fail() {
    echo "error: $*" >&2
    exit 1
}
[ $# -eq 1 ] || fail "expected the target folder: tests/runtimes.sh TARGET_DIR"

# Agents have folders of their own at these paths, so a server refuses a runtime there (COVERED in crates/faceoff/src/config/runtime.rs).
is_covered() {
    case $1/ in
    /tmp/* | /dev/* | /proc/* | /agent/*) true ;;
    /*) false ;;
    # A relative cache folder is ignored.
    *) true ;;
    esac
}

mkdir -p "$1"
folder=$(realpath "$1")/runtimes
if is_covered "$folder"; then
    cache=${XDG_CACHE_HOME:-${HOME:-/tmp}/.cache}
    if is_covered "$cache" || ! mkdir -p "$cache/faceoff" 2>/dev/null || [ ! -w "$cache/faceoff" ]; then
        cache=/var/tmp/faceoff-$(id -u)
        mkdir -p -m 700 "$cache"
        # All users can create folders there, and programs in this one are executed, so it must be the user's own.
        [ ! -L "$cache" ] && [ -O "$cache" ] || fail "$cache is another user's; remove it"
    fi
    # The name is a hash of the sources. So clones with the same sources share a runtime, and other clones do not replace it while tests run.
    hash=$(cd "$repository/docker" && cat runtime.sh python3-ml/requirements.txt python3-ml/faceoff_threads.py | sha256sum)
    folder=$cache/faceoff/runtimes-$(printf '%.16s' "$hash")
fi
"$repository/docker/runtime.sh" "$folder/python3-ml" >&2
echo "$folder"
