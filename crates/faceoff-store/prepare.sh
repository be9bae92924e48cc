#!/bin/sh
# Writes the offline data of the query macros to .sqlx/ at the workspace root, using a scratch database
# with all migrations. With --check it writes nothing and fails if .sqlx/ is out of date.
# Needs python3 and cargo. `cargo sqlx prepare --workspace` produces the same files.
set -eu
cd "$(dirname "$0")/../.."
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
# Only the schema: statements that change rows find none here, and may need a newer SQLite than the one of the system.
python3 - "$scratch/schema.sqlite3" migrations/*.sql <<'END'
import sqlite3, sys

database = sqlite3.connect(sys.argv[1], isolation_level=None)
for path in sys.argv[2:]:
    statement = ""
    for line in open(path, encoding="utf-8"):
        if not statement and (not line.strip() or line.startswith("--")):
            continue
        statement += line
        if sqlite3.complete_statement(statement):
            if statement.split(None, 1)[0].upper() not in ("UPDATE", "INSERT", "DELETE", "WITH"):
                database.execute(statement)
            statement = ""
    if statement.strip():
        sys.exit(f"{path}: incomplete statement: {statement}")
END
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
