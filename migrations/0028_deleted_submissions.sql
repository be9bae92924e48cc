-- The archive of a valid submission may go, too: by its team, an organiser, or its stage's retention. The old CHECK
-- allows refused ones only, and submissions are referred to by much, so that they are made anew in their place: until
-- the transaction ends the references may hang.
PRAGMA defer_foreign_keys = ON;

CREATE TEMPORARY TABLE old_submissions AS SELECT * FROM submissions;
DROP TABLE submissions;

CREATE TABLE submissions (
    id                 TEXT    NOT NULL PRIMARY KEY,
    team_id            TEXT    NOT NULL REFERENCES teams (id),
    bundle_key         TEXT    NOT NULL,
    bundle_bytes       INTEGER NOT NULL CHECK (bundle_bytes >= 0),
    bundle_blake3      TEXT    NOT NULL,
    bundle_file_name   TEXT    NOT NULL,
    created_at         INTEGER NOT NULL,
    agent_name         TEXT,
    state              TEXT    NOT NULL CHECK (state IN ('validating', 'valid', 'invalid', 'validation_error')),
    reason             TEXT    CHECK ((reason IS NOT NULL) = (state IN ('invalid', 'validation_error'))),
    -- JSON, for each task that was played: how long its answers took in its smoke run
    timing             TEXT,
    withdrawn_at       INTEGER,
    label              TEXT,
    -- from then on nobody is promised the archive
    bundle_removed_at  INTEGER,
    -- why; a refused one says so by its state
    bundle_removed_for TEXT    CHECK (bundle_removed_for IS NULL OR bundle_removed_at IS NOT NULL),
    -- has the file followed?
    bundle_gone        INTEGER NOT NULL DEFAULT 0
                       CHECK (bundle_gone = 0 OR bundle_gone = 1 AND bundle_removed_at IS NOT NULL),
    deleted_at         INTEGER CHECK (deleted_at IS NULL OR bundle_removed_at IS NOT NULL),
    deleted_by         TEXT    CHECK ((deleted_by IS NULL) = (deleted_at IS NULL)),
    -- long: the last column
    log                TEXT    CHECK ((log IS NOT NULL) = (state IN ('valid', 'invalid'))),
    CHECK (bundle_removed_at IS NULL OR state IN ('invalid', 'validation_error')
           OR state = 'valid' AND bundle_removed_for IS NOT NULL)
) STRICT;

INSERT INTO submissions (id, team_id, bundle_key, bundle_bytes, bundle_blake3, bundle_file_name, created_at, agent_name,
                         state, reason, timing, withdrawn_at, label, bundle_removed_at, bundle_gone, log)
SELECT id, team_id, bundle_key, bundle_bytes, bundle_blake3, bundle_file_name, created_at, agent_name,
       state, reason, timing, withdrawn_at, label, bundle_removed_at, bundle_removed_at IS NOT NULL, log
FROM old_submissions;
DROP TABLE old_submissions;

CREATE INDEX submissions_of_team ON submissions (team_id, created_at);
CREATE INDEX submissions_of_archive ON submissions (team_id, bundle_blake3, created_at, id);
CREATE INDEX submissions_by_time ON submissions (created_at);
-- What is to be removed is few at any time.
CREATE INDEX refused_bundles ON submissions (id)
    WHERE bundle_removed_at IS NULL AND state IN ('invalid', 'validation_error');
CREATE INDEX bundles_going ON submissions (id) WHERE bundle_removed_at IS NOT NULL AND bundle_gone = 0;

-- What a submission has played, asked before its archive goes.
CREATE INDEX evaluations_of_submission ON evaluations (submission_id);
CREATE INDEX drafts_of_submission ON drafts (submission_id);
