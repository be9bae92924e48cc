#!/bin/sh
# Makes the runtime python3-ml for tests, and prints the folder that it is in: TARGET_DIR/runtimes. Below /tmp and the like agents would
# not see it, and it is in the user's cache, or else below /var/tmp.
#
#   tests/runtimes.sh TARGET_DIR
set -eu
repository=$(dirname "$(dirname "$(realpath "$0")")")
fail() {
    echo "error: $*" >&2
    exit 1
}
[ $# -eq 1 ] || fail "expected the target folder: tests/runtimes.sh TARGET_DIR"

# In place of these folders agents see their own, so a server refuses a runtime there (COVERED in crates/faceoff/src/config/runtime.rs).
is_covered() {
    case $1/ in
    /tmp/* | /dev/* | /proc/* | /agent/*) true ;;
    /*) false ;;
    # The cache folder is to be absolute; another one does not count.
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
        # Everybody may make folders there, and what is in this one is started.
        [ ! -L "$cache" ] && [ -O "$cache" ] || fail "$cache is another user's; remove it"
    fi
    # By what it is made of: clones with the same runtime share it, and none makes another's anew while that one's tests run.
    made_of=$(cd "$repository/docker" && cat runtime.sh python3-ml/requirements.txt python3-ml/faceoff_threads.py | sha256sum)
    folder=$cache/faceoff/runtimes-$(printf '%.16s' "$made_of")
fi
"$repository/docker/runtime.sh" "$folder/python3-ml" >&2
echo "$folder"
