-- The competition's records: what boards and pages need, and the queue of work.
-- Ids are UUIDs as text; instants are milliseconds since 1970-01-01 UTC; days are ISO dates (UTC).
-- The CHECKs say which columns belong to which state, so that no half-made state can be stored.

CREATE TABLE season (
    id                 INTEGER NOT NULL PRIMARY KEY CHECK (id = 1),
    name               TEXT    NOT NULL,
    secret             BLOB    NOT NULL CHECK (length(secret) = 32),
    created_at         INTEGER NOT NULL,
    -- the last day that the daily schedule has started
    last_scheduled_day TEXT
) STRICT;

CREATE TABLE teams (
    id         TEXT    NOT NULL PRIMARY KEY,
    -- "alpha" and "Alpha" on one board would be taken for each other
    name       TEXT    NOT NULL UNIQUE COLLATE NOCASE,
    token_hash BLOB    NOT NULL UNIQUE CHECK (length(token_hash) = 32),
    created_at INTEGER NOT NULL
) STRICT;

CREATE TABLE submissions (
    id               TEXT    NOT NULL PRIMARY KEY,
    team_id          TEXT    NOT NULL REFERENCES teams (id),
    bundle_key       TEXT    NOT NULL,
    bundle_bytes     INTEGER NOT NULL CHECK (bundle_bytes >= 0),
    bundle_blake3    TEXT    NOT NULL,
    bundle_file_name TEXT    NOT NULL,
    created_at       INTEGER NOT NULL,
    agent_name       TEXT,
    state            TEXT    NOT NULL CHECK (state IN ('validating', 'valid', 'invalid', 'validation_error')),
    reason           TEXT    CHECK ((reason IS NOT NULL) = (state IN ('invalid', 'validation_error'))),
    log              TEXT    CHECK ((log IS NOT NULL) = (state IN ('valid', 'invalid')))
) STRICT;

CREATE INDEX submissions_of_team ON submissions (team_id, created_at);

CREATE TABLE evaluations (
    id                 TEXT    NOT NULL PRIMARY KEY,
    submission_id      TEXT    NOT NULL REFERENCES submissions (id),
    team_id            TEXT    NOT NULL REFERENCES teams (id),
    day                TEXT    NOT NULL,
    profile            TEXT    NOT NULL,
    tasks              TEXT    NOT NULL,  -- JSON array, in the order of play
    episodes_per_task  INTEGER NOT NULL CHECK (episodes_per_task > 0),
    episodes_per_shard INTEGER NOT NULL CHECK (episodes_per_shard > 0),
    max_faults         INTEGER NOT NULL CHECK (max_faults >= 0),
    created_at         INTEGER NOT NULL,
    state              TEXT    NOT NULL CHECK (state IN ('queued', 'running', 'finalising',
                                   'finished', 'agent_failed', 'platform_failed', 'cancelled')),
    finished_at        INTEGER CHECK ((finished_at IS NULL) = (state IN ('queued', 'running', 'finalising'))),
    result             TEXT    CHECK ((result IS NOT NULL) = (state = 'finished')),   -- JSON
    dataset            TEXT    CHECK ((dataset IS NOT NULL) = (state = 'finished')),  -- artifact key
    faults             TEXT    CHECK ((faults IS NOT NULL) = (state = 'agent_failed')), -- JSON
    log                TEXT    CHECK ((log IS NOT NULL) = (state = 'agent_failed')),
    reason             TEXT    CHECK ((reason IS NOT NULL) = (state IN ('platform_failed', 'cancelled'))),
    -- when the artifacts of its shards were removed, once it was over
    recordings_removed_at INTEGER
) STRICT;

-- One counting evaluation per team and UTC day. A run that we broke or cancelled gives the turn back.
CREATE UNIQUE INDEX one_turn_per_team_and_day ON evaluations (team_id, day)
    WHERE state NOT IN ('platform_failed', 'cancelled');
CREATE INDEX evaluations_of_day ON evaluations (day, created_at);

CREATE TABLE shards (
    id            TEXT    NOT NULL PRIMARY KEY,
    evaluation_id TEXT    NOT NULL REFERENCES evaluations (id),
    -- position in the evaluation: task by task, first episode by first episode
    position      INTEGER NOT NULL CHECK (position >= 0),
    task          TEXT    NOT NULL,
    first_episode INTEGER NOT NULL CHECK (first_episode >= 0),
    end_episode   INTEGER NOT NULL CHECK (end_episode > first_episode),
    -- set together by the one commit
    committed_at  INTEGER,
    recording     TEXT    CHECK ((recording IS NULL) = (committed_at IS NULL)),   -- artifact key prefix
    outcomes      TEXT    CHECK ((outcomes IS NULL) = (committed_at IS NULL)),    -- JSON
    agent_faults  INTEGER CHECK ((agent_faults IS NULL) = (committed_at IS NULL)),
    log           TEXT    CHECK ((log IS NULL) = (committed_at IS NULL)),
    UNIQUE (evaluation_id, position),
    UNIQUE (evaluation_id, task, first_episode)
) STRICT;

-- The queue. A unit is claimed by a lease of seconds: `claimable_at` is when it may be claimed (again),
-- be it queued, held back after a failure, or leased to a worker that must renew.
CREATE TABLE work_units (
    queue_no      INTEGER NOT NULL PRIMARY KEY,
    id            TEXT    NOT NULL UNIQUE,
    kind          TEXT    NOT NULL CHECK (kind IN ('smoke', 'finalise', 'shard')),
    -- teams wait for a smoke run and for a finished score; shards are the bulk
    urgency       INTEGER NOT NULL GENERATED ALWAYS AS
                      (CASE kind WHEN 'smoke' THEN 0 WHEN 'finalise' THEN 1 ELSE 2 END) STORED,
    submission_id TEXT    NOT NULL REFERENCES submissions (id),
    evaluation_id TEXT    REFERENCES evaluations (id) CHECK ((evaluation_id IS NULL) = (kind = 'smoke')),
    shard_id      TEXT    UNIQUE REFERENCES shards (id) CHECK ((shard_id IS NULL) = (kind <> 'shard')),
    state         TEXT    NOT NULL CHECK (state IN ('queued', 'leased', 'done', 'dropped')),
    claimable_at  INTEGER NOT NULL,
    -- leases given, less the ones handed back at a shutdown
    attempts      INTEGER NOT NULL DEFAULT 0 CHECK (attempts >= 0),
    -- attempts that ended by a reported fault of ours
    failures      INTEGER NOT NULL DEFAULT 0 CHECK (failures >= 0),
    worker        TEXT    CHECK (worker IS NOT NULL OR state NOT IN ('leased', 'done')),
    -- proof of the lease; kept when done, so that its holder may commit again without harm
    nonce         TEXT    CHECK ((nonce IS NOT NULL) = (state IN ('leased', 'done'))),
    episodes_done INTEGER NOT NULL DEFAULT 0 CHECK (episodes_done >= 0)
) STRICT;

CREATE INDEX work_units_open ON work_units (urgency, queue_no) WHERE state IN ('queued', 'leased');
CREATE INDEX work_units_of_submission ON work_units (submission_id, kind);
CREATE UNIQUE INDEX one_finalise_per_evaluation ON work_units (evaluation_id) WHERE kind = 'finalise';
CREATE INDEX work_units_of_evaluation ON work_units (evaluation_id);
