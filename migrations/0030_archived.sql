-- The database of an archive, and of a server that shows one: a season that stands still. A running season has no row.

CREATE TABLE archived (
    id          INTEGER NOT NULL PRIMARY KEY CHECK (id = 1),
    edition     TEXT    NOT NULL CHECK (edition IN ('public', 'organiser')),
    -- the moment that it shows
    made_at     INTEGER NOT NULL,
    program     TEXT    NOT NULL,
    -- BLAKE3 of the season's secret, which is only here if it was public by then
    commitment  TEXT    NOT NULL,
    -- when another server took it in; NULL in the archive
    imported_at INTEGER
) STRICT;

-- The public seeds of days, which follow from a secret that is not here.
CREATE TABLE archived_seeds (
    stage_id TEXT NOT NULL,
    day      TEXT NOT NULL,
    seed     BLOB NOT NULL CHECK (length(seed) = 32),
    PRIMARY KEY (stage_id, day)
) STRICT, WITHOUT ROWID;
