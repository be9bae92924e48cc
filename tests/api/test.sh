#!/bin/sh
# Tests the API by its document, against a real server: what a stranger's tools make of /api/v1/openapi.json.
#   test.sh [...]   validates it, tries every operation as three roles, makes two clients of it and has both upload,
#                   follow and download. The arguments go to pytest
# TARGET_DIR (default: target), PYTHON (default: python3) and FACEOFF_BIN (default: TARGET/debug/faceoff) may be set.
set -eu

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
target=${TARGET_DIR:-$root/target}
mkdir -p "$target"
target=$(cd "$target" && pwd)
python=${PYTHON:-python3}

wanted=$(cksum < "$here/requirements.txt")
if [ "$(cat "$target/api-test/made-of" 2>/dev/null)" != "$wanted" ]; then
    rm -rf "$target/api-test"
    "$python" -m venv "$target/api-test"
    "$target/api-test/bin/python" -m pip install --quiet --disable-pip-version-check -r "$here/requirements.txt"
    echo "$wanted" > "$target/api-test/made-of"
fi
# The TypeScript client is made, checked and run beside its packages, which are installed when their list has changed.
wanted=$(cat "$here/typescript/package.json" "$here/typescript/package-lock.json" | cksum)
if [ "$(cat "$target/api-typescript/made-of" 2>/dev/null)" != "$wanted" ]; then
    rm -rf "$target/api-typescript"
    mkdir -p "$target/api-typescript"
    cp "$here/typescript/package.json" "$here/typescript/package-lock.json" "$target/api-typescript/"
    npm ci --prefix "$target/api-typescript" --ignore-scripts --no-audit --no-fund --silent
    echo "$wanted" > "$target/api-typescript/made-of"
fi

export FACEOFF_BIN="${FACEOFF_BIN:-$target/debug/faceoff}" API_TYPESCRIPT="$target/api-typescript"
# What schemathesis writes goes beside all else that is made.
cd "$target/api-test"
PATH="$target/api-test/bin:$PATH" exec "$target/api-test/bin/python" -m pytest -p no:cacheprovider -rs --durations 8 \
    --rootdir "$here" "$here" "$@"
