-- A season has stages, each with its own days, rules and board. What a folder has played by now is its first.

CREATE TABLE stages (
    id          TEXT    NOT NULL PRIMARY KEY,
    name        TEXT    NOT NULL UNIQUE COLLATE NOCASE,
    -- from then on its rules are fixed: a change is another revision
    opens_at    INTEGER NOT NULL,
    -- from then on none of its days starts; NULL: it has no end yet
    closes_at   INTEGER CHECK (closes_at > opens_at),
    zone        TEXT    NOT NULL,  -- IANA name; days are dates there
    settings    TEXT    NOT NULL,  -- JSON; what may change without a score depending on it
    -- does its id enter the seeds of its days? Not if they were played before there were stages
    names_seeds INTEGER NOT NULL CHECK (names_seeds IN (0, 1)),
    -- does it take rules and settings from the server's configuration, at each start?
    configured  INTEGER NOT NULL CHECK (configured IN (0, 1)),
    created_at  INTEGER NOT NULL
) STRICT;

CREATE UNIQUE INDEX one_configured_stage ON stages (configured) WHERE configured = 1;

-- What scores depend on. Rows of two revisions never stand on one board.
CREATE TABLE stage_revisions (
    stage_id TEXT    NOT NULL REFERENCES stages (id),
    revision INTEGER NOT NULL CHECK (revision > 0),
    since    INTEGER NOT NULL,
    rules    TEXT    NOT NULL,  -- JSON
    PRIMARY KEY (stage_id, revision)
) STRICT, WITHOUT ROWID;

INSERT INTO stages (id, name, opens_at, zone, settings, names_seeds, configured, created_at)
SELECT lower(hex(randomblob(4)) || '-' || hex(randomblob(2)) || '-4' || substr(hex(randomblob(2)), 2) || '-a'
             || substr(hex(randomblob(2)), 2) || '-' || hex(randomblob(6))),
       'Qualifying', created_at, 'UTC', '{"episodes_per_shard":50}', 0, 1, created_at
FROM season;

-- The rules that days were played by, in the order in which they came up.
CREATE TEMPORARY TABLE played_rules AS
SELECT r.ruleset, r.profile, r.tasks, r.episodes_per_task, r.max_faults, MIN(e.created_at) AS since,
       ROW_NUMBER() OVER (ORDER BY MIN(e.day), MIN(e.created_at), MIN(e.id)) AS revision
FROM evaluations e JOIN runs r ON r.id = e.run_id
GROUP BY r.ruleset, r.profile, r.tasks, r.episodes_per_task, r.max_faults;

INSERT INTO stage_revisions (stage_id, revision, since, rules)
SELECT s.id, p.revision, p.since,
       json_object('ruleset', p.ruleset, 'profile', p.profile, 'tasks', json(p.tasks),
                   'episodes_per_task', p.episodes_per_task, 'max_faults', p.max_faults)
FROM played_rules p, stages s;

-- Days are a stage's. The old tables step aside, and go once the new ones are filled, children first.
DROP TRIGGER a_cut_stays_where_it_is;
DROP TRIGGER a_released_day_stays_released;
ALTER TABLE days RENAME TO old_days;
ALTER TABLE finalisations RENAME TO old_finalisations;
ALTER TABLE evaluations RENAME TO old_evaluations;

CREATE TABLE days (
    stage_id    TEXT    NOT NULL REFERENCES stages (id),
    day         TEXT    NOT NULL,  -- ISO date in the stage's zone
    cut_at      INTEGER NOT NULL,
    -- when its seed, its datasets and its logs were given to those they belong to
    released_at INTEGER,
    PRIMARY KEY (stage_id, day)
) STRICT, WITHOUT ROWID;

INSERT INTO days (stage_id, day, cut_at, released_at)
SELECT s.id, d.day, d.cut_at, d.released_at FROM old_days d, stages s;

CREATE TRIGGER a_cut_stays_where_it_is BEFORE UPDATE OF stage_id, day, cut_at ON days
    BEGIN SELECT RAISE(ABORT, 'the day has had its cut'); END;
CREATE TRIGGER a_released_day_stays_released BEFORE UPDATE OF released_at ON days
    WHEN OLD.released_at IS NOT NULL
    BEGIN SELECT RAISE(ABORT, 'the day is released'); END;

CREATE TABLE evaluations (
    id             TEXT    NOT NULL PRIMARY KEY,
    submission_id  TEXT    NOT NULL REFERENCES submissions (id),
    team_id        TEXT    NOT NULL REFERENCES teams (id),
    stage_id       TEXT    NOT NULL,
    day            TEXT    NOT NULL,
    revision       INTEGER NOT NULL,
    run_id         TEXT    NOT NULL UNIQUE REFERENCES runs (id),
    -- which it plays again: one that we broke, or that was cancelled
    rerun_of       TEXT    REFERENCES evaluations (id),
    created_at     INTEGER NOT NULL,
    state          TEXT    NOT NULL CHECK (state IN ('open', 'finished', 'agent_failed', 'platform_failed',
                                                     'cancelled')),
    finished_at    INTEGER CHECK ((finished_at IS NULL) = (state = 'open')),
    reason         TEXT    CHECK ((reason IS NOT NULL) = (state IN ('platform_failed', 'cancelled'))),
    dataset        TEXT    CHECK ((dataset IS NOT NULL) = (state = 'finished')),     -- artifact key
    -- of the archive; unknown of those made by older programs
    dataset_blake3 TEXT    CHECK (dataset_blake3 IS NULL OR state = 'finished'),
    result         TEXT    CHECK ((result IS NOT NULL) = (state = 'finished')),      -- JSON
    FOREIGN KEY (stage_id, day) REFERENCES days (stage_id, day),
    FOREIGN KEY (stage_id, revision) REFERENCES stage_revisions (stage_id, revision)
) STRICT;

INSERT INTO evaluations (id, submission_id, team_id, stage_id, day, revision, run_id, rerun_of, created_at,
                         state, finished_at, reason, dataset, dataset_blake3, result)
SELECT e.id, e.submission_id, e.team_id, s.id, e.day, p.revision, e.run_id, e.rerun_of, e.created_at,
       e.state, e.finished_at, e.reason, e.dataset, e.dataset_blake3, e.result
FROM old_evaluations e
JOIN runs r ON r.id = e.run_id
JOIN played_rules p ON (p.ruleset, p.profile, p.tasks, p.episodes_per_task, p.max_faults)
                     = (r.ruleset, r.profile, r.tasks, r.episodes_per_task, r.max_faults)
JOIN stages s
ORDER BY e.created_at, e.id;

CREATE TABLE finalisations (
    evaluation_id TEXT NOT NULL PRIMARY KEY REFERENCES evaluations (id),
    unit_id       TEXT NOT NULL UNIQUE REFERENCES units (id)
) STRICT, WITHOUT ROWID;

INSERT INTO finalisations (evaluation_id, unit_id) SELECT evaluation_id, unit_id FROM old_finalisations;

DROP TABLE played_rules;
DROP TABLE old_finalisations;
-- Its rows refer to each other.
UPDATE old_evaluations SET rerun_of = NULL;
DROP TABLE old_evaluations;
DROP TABLE old_days;

-- One counting evaluation per team, stage and day. A run that we broke or cancelled gives the turn back.
CREATE UNIQUE INDEX one_turn_per_team_and_day ON evaluations (team_id, stage_id, day)
    WHERE state NOT IN ('platform_failed', 'cancelled');
-- with the state, so that the finished ones of all days are counted without reading the rows
CREATE INDEX evaluations_of_day ON evaluations (stage_id, day, created_at, state);
CREATE INDEX evaluations_on_date ON evaluations (day, created_at);
CREATE INDEX evaluations_of_team ON evaluations (team_id, created_at);
-- a board: the newest finished day of each team
CREATE INDEX evaluations_on_the_board ON evaluations (team_id, stage_id, revision, day DESC)
    WHERE state = 'finished';
-- the newest rules that something is finished under
CREATE INDEX evaluations_of_revision ON evaluations (stage_id, revision) WHERE state = 'finished';
CREATE INDEX evaluations_open ON evaluations (stage_id, day) WHERE state = 'open';

-- Rules belong to revisions now, which boards go by.
DROP INDEX runs_of_ruleset;
