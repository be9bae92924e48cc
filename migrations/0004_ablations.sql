-- Ablations: a submission under each perturbation alone. They take no turn and reach no board, so they
-- are no evaluations; their runs are units of the same queue, behind all others.
CREATE TABLE ablations (
    id                TEXT    NOT NULL PRIMARY KEY,
    submission_id     TEXT    NOT NULL REFERENCES submissions (id),
    episodes_per_task INTEGER NOT NULL CHECK (episodes_per_task > 0),
    max_faults        INTEGER NOT NULL CHECK (max_faults >= 0),
    created_at        INTEGER NOT NULL,
    finished_at       INTEGER,
    -- why it ended without a result
    reason            TEXT    CHECK (reason IS NULL OR finished_at IS NOT NULL)
) STRICT;

CREATE INDEX ablations_of_submission ON ablations (submission_id, created_at);
CREATE UNIQUE INDEX one_open_ablation_per_submission ON ablations (submission_id) WHERE finished_at IS NULL;

-- One task under one profile.
CREATE TABLE ablation_runs (
    id          TEXT NOT NULL PRIMARY KEY,
    ablation_id TEXT NOT NULL REFERENCES ablations (id),
    profile     TEXT NOT NULL,
    task        TEXT NOT NULL,
    outcomes    TEXT,  -- JSON, once played
    UNIQUE (ablation_id, profile, task)
) STRICT;

-- The queue with one more kind; SQLite changes no CHECK in place.
CREATE TABLE work_units_with_ablations (
    queue_no      INTEGER NOT NULL PRIMARY KEY,
    id            TEXT    NOT NULL UNIQUE,
    kind          TEXT    NOT NULL CHECK (kind IN ('smoke', 'finalise', 'shard', 'ablation')),
    -- teams wait for a smoke run and for a finished score; shards are the bulk; ablations can wait
    urgency       INTEGER NOT NULL GENERATED ALWAYS AS
                      (CASE kind WHEN 'smoke' THEN 0 WHEN 'finalise' THEN 1 WHEN 'shard' THEN 2 ELSE 3 END) STORED,
    submission_id TEXT    NOT NULL REFERENCES submissions (id),
    evaluation_id TEXT    REFERENCES evaluations (id)
                      CHECK ((evaluation_id IS NULL) = (kind IN ('smoke', 'ablation'))),
    shard_id      TEXT    UNIQUE REFERENCES shards (id) CHECK ((shard_id IS NULL) = (kind <> 'shard')),
    state         TEXT    NOT NULL CHECK (state IN ('queued', 'leased', 'done', 'dropped')),
    claimable_at  INTEGER NOT NULL,
    attempts      INTEGER NOT NULL DEFAULT 0 CHECK (attempts >= 0),
    failures      INTEGER NOT NULL DEFAULT 0 CHECK (failures >= 0),
    worker        TEXT    CHECK (worker IS NOT NULL OR state NOT IN ('leased', 'done')),
    nonce         TEXT    CHECK ((nonce IS NOT NULL) = (state IN ('leased', 'done'))),
    episodes_done INTEGER NOT NULL DEFAULT 0 CHECK (episodes_done >= 0),
    ablation_run_id TEXT  UNIQUE REFERENCES ablation_runs (id)
                      CHECK ((ablation_run_id IS NULL) = (kind <> 'ablation'))
) STRICT;

INSERT INTO work_units_with_ablations (queue_no, id, kind, submission_id, evaluation_id, shard_id, state,
                                       claimable_at, attempts, failures, worker, nonce, episodes_done)
SELECT queue_no, id, kind, submission_id, evaluation_id, shard_id, state,
       claimable_at, attempts, failures, worker, nonce, episodes_done FROM work_units;
DROP TABLE work_units;
ALTER TABLE work_units_with_ablations RENAME TO work_units;

CREATE INDEX work_units_open ON work_units (urgency, queue_no) WHERE state IN ('queued', 'leased');
CREATE INDEX work_units_of_submission ON work_units (submission_id, kind);
CREATE UNIQUE INDEX one_finalise_per_evaluation ON work_units (evaluation_id) WHERE kind = 'finalise';
CREATE INDEX work_units_of_evaluation ON work_units (evaluation_id);
