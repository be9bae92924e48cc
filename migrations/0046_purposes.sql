-- One table of evaluations, whatever they are for. One that counts is the evaluation of a team on a day. One of a proposal
-- does not count: a trial never does, a re-evaluation does once an organiser applies its proposal. Whatever concerns
-- days, boards and teams reads the view `counting_evaluations`, so that it cannot include the others.

PRAGMA defer_foreign_keys = ON;

ALTER TABLE evaluations RENAME TO old_evaluations;
ALTER TABLE scorings RENAME TO old_scorings;

CREATE TABLE evaluations (
    id             TEXT    NOT NULL PRIMARY KEY,
    purpose        TEXT    NOT NULL CHECK (purpose IN ('counting', 'trial', 'reevaluation')),
    -- the proposal that it was made by; one that is applied keeps it
    proposal_id    TEXT    REFERENCES proposals (id) CHECK (purpose = 'counting' OR proposal_id IS NOT NULL),
    submission_id  TEXT    NOT NULL REFERENCES submissions (id),
    team_id        TEXT    NOT NULL REFERENCES teams (id),
    stage_id       TEXT    NOT NULL,
    -- a trial has episodes of its own, of no day
    day            TEXT    CHECK ((day IS NULL) = (purpose = 'trial')),
    revision       INTEGER NOT NULL,
    run_id         TEXT    NOT NULL UNIQUE REFERENCES runs (id),
    -- the evaluation that it repeats
    rerun_of       TEXT    REFERENCES evaluations (id),
    created_at     INTEGER NOT NULL,
    state          TEXT    NOT NULL CHECK (state IN ('open', 'finished', 'agent_failed', 'platform_failed',
                                                     'cancelled')),
    finished_at    INTEGER CHECK ((finished_at IS NULL) = (state = 'open')),
    reason         TEXT    CHECK ((reason IS NOT NULL) = (state IN ('platform_failed', 'cancelled'))),
    -- artifact key of the archive
    dataset        TEXT    CHECK ((dataset IS NOT NULL) = (state = 'finished')),
    -- of the archive; unknown for archives of early versions
    dataset_blake3 TEXT    CHECK (dataset_blake3 IS NULL OR state = 'finished'),
    -- JSON
    result         TEXT    CHECK ((result IS NOT NULL) = (state = 'finished')),
    voided_at      INTEGER CHECK (voided_at IS NULL OR state IN ('finished', 'agent_failed')),
    voided_for     TEXT    CHECK ((voided_for IS NULL) = (voided_at IS NULL)),
    published_at   INTEGER CHECK (published_at IS NULL OR state = 'finished'),
    unplayed       INTEGER NOT NULL DEFAULT 0 CHECK (unplayed = 0 OR unplayed = 1 AND state = 'cancelled'),
    slot_ms        INTEGER CHECK (slot_ms >= 0),
    extra_for      TEXT,
    dataset_bytes  INTEGER CHECK (dataset_bytes IS NULL OR dataset_bytes >= 0 AND state = 'finished'),
    dataset_removed_at  INTEGER CHECK (dataset_removed_at IS NULL OR state = 'finished'),
    dataset_removed_for TEXT    CHECK ((dataset_removed_for IS NULL) = (dataset_removed_at IS NULL)),
    dataset_gone   INTEGER NOT NULL DEFAULT 0
        CHECK (dataset_gone = 0 OR dataset_gone = 1 AND dataset_removed_at IS NOT NULL),
    CHECK (purpose = 'counting' OR voided_at IS NULL AND published_at IS NULL AND extra_for IS NULL AND unplayed = 0),
    FOREIGN KEY (stage_id, day) REFERENCES days (stage_id, day),
    FOREIGN KEY (stage_id, revision) REFERENCES stage_revisions (stage_id, revision)
) STRICT;

INSERT INTO evaluations (id, purpose, proposal_id, submission_id, team_id, stage_id, day, revision, run_id, rerun_of,
                         created_at, state, finished_at, reason, dataset, dataset_blake3, result, voided_at, voided_for,
                         published_at, unplayed, slot_ms, extra_for, dataset_bytes, dataset_removed_at,
                         dataset_removed_for, dataset_gone)
SELECT e.id, 'counting', p.proposal_id, e.submission_id, e.team_id, e.stage_id, e.day, e.revision, e.run_id, e.rerun_of,
       e.created_at, e.state, e.finished_at, e.reason, e.dataset, e.dataset_blake3, e.result, e.voided_at, e.voided_for,
       e.published_at, e.unplayed, e.slot_ms, e.extra_for, e.dataset_bytes, e.dataset_removed_at,
       e.dataset_removed_for, e.dataset_gone
FROM old_evaluations e LEFT JOIN proposed_evaluations p ON p.id = e.id
ORDER BY e.rowid;

INSERT INTO evaluations (id, purpose, proposal_id, submission_id, team_id, stage_id, day, revision, run_id, rerun_of,
                         created_at, state, finished_at, reason, dataset, dataset_blake3, result, dataset_bytes,
                         dataset_removed_at, dataset_removed_for, dataset_gone)
SELECT e.id, CASE p.kind WHEN 'trial' THEN 'trial' ELSE 'reevaluation' END, p.id, e.submission_id, e.team_id,
       p.stage_id, p.day, p.revision, e.run_id, e.replaces, e.created_at, e.state, e.finished_at, e.reason, e.dataset,
       e.dataset_blake3, e.result, e.dataset_bytes, e.dataset_removed_at,
       CASE WHEN e.dataset_removed_at IS NOT NULL THEN 'the proposal was dropped' END, e.dataset_removed_at IS NOT NULL
FROM proposed_evaluations e JOIN proposals p ON p.id = e.proposal_id
WHERE e.id NOT IN (SELECT id FROM old_evaluations)
ORDER BY e.rowid;

CREATE TABLE scorings (
    evaluation_id TEXT NOT NULL PRIMARY KEY REFERENCES evaluations (id),
    job_id        TEXT NOT NULL UNIQUE REFERENCES jobs (id)
) STRICT, WITHOUT ROWID;

-- An applied evaluation has the same job in both tables.
INSERT INTO scorings (evaluation_id, job_id)
SELECT evaluation_id, job_id FROM old_scorings
UNION
SELECT proposed_evaluation_id, job_id FROM proposed_evaluation_scorings;

DROP TABLE proposed_evaluation_scorings;
DROP TABLE proposed_evaluations;
DROP TABLE old_scorings;
-- Its rows refer to each other.
UPDATE old_evaluations SET rerun_of = NULL;
DROP TABLE old_evaluations;

CREATE VIEW counting_evaluations AS SELECT rowid AS row_no, * FROM evaluations WHERE purpose = 'counting';

CREATE TRIGGER a_final_result_is_not_changed BEFORE UPDATE OF voided_at, result, state, purpose ON evaluations
    WHEN NEW.purpose = 'counting'
         AND EXISTS (SELECT 1 FROM stages s WHERE s.id = OLD.stage_id AND s.finalised_at IS NOT NULL)
    BEGIN SELECT RAISE(ABORT, 'the stage is signed off'); END;
CREATE TRIGGER what_counts_stays_counted BEFORE UPDATE OF purpose ON evaluations
    WHEN OLD.purpose = 'counting' AND NEW.purpose <> 'counting'
    BEGIN SELECT RAISE(ABORT, 'the evaluation counts'); END;

-- A team has one evaluation that counts per stage, day and revision of the rules. One with a platform fault, a cancelled
-- one and a voided one can be repeated.
CREATE UNIQUE INDEX one_evaluation_per_team_and_day ON evaluations (team_id, stage_id, day, revision)
    WHERE purpose = 'counting' AND state NOT IN ('platform_failed', 'cancelled') AND voided_at IS NULL;
-- The newest finished day of each team: a board.
CREATE INDEX evaluations_on_the_board ON evaluations (team_id, stage_id, revision, day DESC)
    WHERE purpose = 'counting' AND state = 'finished' AND voided_at IS NULL;
-- The newest rules with a finished evaluation.
CREATE INDEX evaluations_of_revision ON evaluations (stage_id, revision)
    WHERE purpose = 'counting' AND state = 'finished' AND voided_at IS NULL;
-- With the state, so that the finished ones of all days are counted without reading the rows.
CREATE INDEX evaluations_of_day ON evaluations (stage_id, day, created_at, state, voided_at, purpose);
CREATE INDEX evaluations_on_date ON evaluations (day, created_at) WHERE purpose = 'counting';
CREATE INDEX evaluations_of_team ON evaluations (team_id, created_at) WHERE purpose = 'counting';
CREATE INDEX evaluations_open ON evaluations (stage_id, day, purpose) WHERE state = 'open';
CREATE INDEX evaluations_of_submission ON evaluations (submission_id);
CREATE INDEX evaluations_of_proposal ON evaluations (proposal_id, created_at) WHERE proposal_id IS NOT NULL;
CREATE INDEX datasets_going ON evaluations (id) WHERE dataset_removed_at IS NOT NULL AND dataset_gone = 0;
CREATE INDEX datasets_unmeasured ON evaluations (id)
    WHERE state = 'finished' AND dataset_bytes IS NULL AND dataset_removed_at IS NULL;
-- Sizes of the datasets of a team.
CREATE INDEX datasets_of_team ON evaluations (team_id, stage_id, day, dataset_bytes, purpose)
    WHERE state = 'finished' AND dataset_removed_at IS NULL;
