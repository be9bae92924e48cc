#!/bin/sh
# Writes the offline data of the query macros to .sqlx/ at the workspace root, from a scratch database
# made of the migrations. With --check it writes nothing and fails if .sqlx/ is not what it would write.
# Needs sqlite3 and cargo; the same files come from `cargo sqlx prepare --workspace`, if you have it.
set -eu
cd "$(dirname "$0")/../.."
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cat migrations/*.sql | sqlite3 "$scratch/schema.sqlite3"
mkdir "$scratch/sqlx"
touch crates/faceoff-store/src/lib.rs # cargo does not know that the environment matters
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
