-- Evaluations that do not count: trials, which never will, and re-evaluations until they are applied. They are in no
-- table of what counts, so that no board, no turn and no day can mistake them for it.

CREATE TABLE proposals (
    id         TEXT    NOT NULL PRIMARY KEY,
    stage_id   TEXT    NOT NULL,
    revision   INTEGER NOT NULL,  -- by which of the stage's rules it is played
    kind       TEXT    NOT NULL CHECK (kind IN ('trial', 'evaluation', 'day', 'rules')),
    day        TEXT    CHECK ((day IS NULL) = (kind = 'trial')),
    reason     TEXT    NOT NULL,
    created_at INTEGER NOT NULL,
    settled_at INTEGER,
    outcome    TEXT    CHECK (outcome IN ('applied', 'dropped')),
    CHECK ((outcome IS NULL) = (settled_at IS NULL)),
    CHECK (kind <> 'trial' OR outcome IS NOT 'applied'),
    FOREIGN KEY (stage_id, day) REFERENCES days (stage_id, day),
    FOREIGN KEY (stage_id, revision) REFERENCES stage_revisions (stage_id, revision)
) STRICT;

CREATE INDEX proposals_by_time ON proposals (created_at);

CREATE TABLE drafts (
    id             TEXT    NOT NULL PRIMARY KEY,  -- of the evaluation that it becomes
    proposal_id    TEXT    NOT NULL REFERENCES proposals (id),
    submission_id  TEXT    NOT NULL REFERENCES submissions (id),
    team_id        TEXT    NOT NULL REFERENCES teams (id),
    replaces       TEXT    REFERENCES evaluations (id),
    run_id         TEXT    NOT NULL UNIQUE REFERENCES runs (id),
    created_at     INTEGER NOT NULL,
    state          TEXT    NOT NULL CHECK (state IN ('open', 'finished', 'agent_failed', 'platform_failed',
                                                     'cancelled')),
    finished_at    INTEGER CHECK ((finished_at IS NULL) = (state = 'open')),
    reason         TEXT    CHECK ((reason IS NOT NULL) = (state IN ('platform_failed', 'cancelled'))),
    dataset        TEXT    CHECK ((dataset IS NOT NULL) = (state = 'finished')),
    dataset_blake3 TEXT    CHECK ((dataset_blake3 IS NOT NULL) = (state = 'finished')),
    result         TEXT    CHECK ((result IS NOT NULL) = (state = 'finished')),
    -- when the dataset was removed, since nobody will apply it
    dataset_removed_at INTEGER
) STRICT;

CREATE INDEX drafts_of_proposal ON drafts (proposal_id, created_at);
CREATE INDEX drafts_open ON drafts (proposal_id) WHERE state = 'open';
-- whose recordings are no longer needed
CREATE INDEX drafts_over ON drafts (finished_at) WHERE finished_at IS NOT NULL;

CREATE TABLE draft_finalisations (
    draft_id TEXT NOT NULL PRIMARY KEY REFERENCES drafts (id),
    unit_id  TEXT NOT NULL UNIQUE REFERENCES units (id)
) STRICT, WITHOUT ROWID;

-- What was played again by other rules counts beside what it was played by first: their boards are two.
DROP INDEX one_turn_per_team_and_day;
CREATE UNIQUE INDEX one_turn_per_team_and_day ON evaluations (team_id, stage_id, day, revision)
    WHERE state NOT IN ('platform_failed', 'cancelled') AND voided_at IS NULL;
