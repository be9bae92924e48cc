#!/bin/sh
# Packs a built agent as a bundle: agent.toml at the root and the program beside it.
# usage: pack.sh PROGRAM BUNDLE.tar.gz      (PROGRAM: for example target/release/striker)
set -eu
if [ $# -ne 2 ]; then
    echo "usage: $0 PROGRAM BUNDLE.tar.gz" >&2
    exit 2
fi
here=$(cd "$(dirname "$0")" && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
install -m 755 "$1" "$folder/striker"
install -m 644 "$here/agent.toml" "$folder/agent.toml"
tar -C "$folder" -czf "$2" agent.toml striker
