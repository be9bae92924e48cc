#!/bin/sh
# Writes the offline data of the query macros to .sqlx/ at the workspace root, using a scratch database
# with all migrations. With --check it writes nothing and fails if .sqlx/ is out of date.
# Needs sqlite3 and cargo. `cargo sqlx prepare --workspace` produces the same files.
set -eu
cd "$(dirname "$0")/../.."
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cat migrations/*.sql | sqlite3 "$scratch/schema.sqlite3"
mkdir "$scratch/sqlx"
touch crates/faceoff-store/src/lib.rs # forces a rebuild: cargo does not track the environment
SQLX_OFFLINE=false DATABASE_URL="sqlite://$scratch/schema.sqlite3" SQLX_OFFLINE_DIR="$scratch/sqlx" \
    cargo check --quiet -p faceoff-store
touch crates/faceoff-store/src/lib.rs
if [ "${1-}" = --check ]; then
    diff -r "$scratch/sqlx" .sqlx || {
        echo ".sqlx/ is out of date: run crates/faceoff-store/prepare.sh and commit" >&2
        exit 1
    }
else
    rm -rf .sqlx
    mv "$scratch/sqlx" .sqlx
fi
