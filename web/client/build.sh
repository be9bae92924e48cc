#!/bin/sh
# Builds the script of the replay pages. `build` rebuilds web/client/dist; `test` checks the sources, builds into a temporary
# folder, and compares the result byte by byte with the committed files. The program embeds those, so that Node is optional.
set -eu
cd "$(dirname "$0")"
if ! node -e 'const [major, minor] = process.versions.node.split(".").map(Number);
              process.exit(major > 20 || (major === 20 && minor >= 19) ? 0 : 1)' 2>/dev/null; then
    echo "web/client: Node.js 20.19 or newer not found; using the committed script" >&2
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
                echo "web/client/$file differs from the build of its sources: run \`make web\` and commit it" >&2
                exit 1
            }
        done ;;
    *) echo "usage: $0 build|test" >&2; exit 2 ;;
esac
