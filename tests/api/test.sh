#!/bin/sh
# Tests the API document /api/v1/openapi.json with independent tools, against a real server.
#   test.sh [...]   validates it, tests every operation in three roles, generates two clients and lets both upload, poll
#                   and download. Arguments are passed to pytest
# TARGET_DIR (default: target), PYTHON (default: python3) and FACEOFF_BIN (default: TARGET/debug/faceoff) may be set.
set -eu

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
target=${TARGET_DIR:-$root/target}
mkdir -p "$target"
target=$(cd "$target" && pwd)

"$root/tests/python-environment.sh" "$target/api-test" "$here/requirements.txt"
# The TypeScript client is generated, checked and run in the folder of its packages. They are installed again when their list changes.
required=$(cat "$here/typescript/package.json" "$here/typescript/package-lock.json" | cksum)
if [ "$(cat "$target/api-typescript/made-of" 2>/dev/null)" != "$required" ]; then
    rm -rf "$target/api-typescript"
    mkdir -p "$target/api-typescript"
    cp "$here/typescript/package.json" "$here/typescript/package-lock.json" "$target/api-typescript/"
    npm ci --prefix "$target/api-typescript" --ignore-scripts --no-audit --no-fund --silent
    echo "$required" > "$target/api-typescript/made-of"
fi

export FACEOFF_BIN="${FACEOFF_BIN:-$target/debug/faceoff}" API_TYPESCRIPT="$target/api-typescript"
# schemathesis writes its files into the current folder. The tests of the three roles, which take longest, run at once.
cd "$target/api-test"
PATH="$target/api-test/bin:$PATH" exec "$target/api-test/bin/python" -m pytest -n 3 -p no:cacheprovider -rs --durations 8 \
    --rootdir "$here" "$here" "$@"
