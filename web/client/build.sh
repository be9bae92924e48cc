#!/bin/sh
# The script of the replay pages. `build` makes web/client/dist anew; `test` checks the sources, makes it beside, and compares
# it byte by byte with what is committed, which is what the program embeds: a machine without Node needs none.
set -eu
cd "$(dirname "$0")"
if ! node -e 'const [major, minor] = process.versions.node.split(".").map(Number);
              process.exit(major > 20 || (major === 20 && minor >= 19) ? 0 : 1)' 2>/dev/null; then
    echo "web/client: no Node.js of at least 20.19; the committed script is used as it is" >&2
    exit 0
fi
npm ci --no-audit --no-fund --loglevel=error
case ${1:-} in
    build) npm run build ;;
    test)
        npm run check
        made=$(mktemp -d)
        trap 'rm -rf "$made"' EXIT
        npm run build -- --outDir "$made" --emptyOutDir
        for file in dist/*; do
            cmp "$file" "$made/${file#dist/}" || {
                echo "web/client/$file is not what its sources make: run \`make web\` and commit it" >&2
                exit 1
            }
        done ;;
    *) echo "usage: $0 build|test" >&2; exit 2 ;;
esac
