-- The store in levels: units of work that know nothing of what they are for, runs that evaluations and
-- ablations own alike, and a record of what happened.
--
-- The old tables step aside, the new ones are filled from them, and the old ones go, children first.

ALTER TABLE work_units RENAME TO old_work_units;
ALTER TABLE evaluations RENAME TO old_evaluations;
ALTER TABLE shards RENAME TO old_shards;
ALTER TABLE ablations RENAME TO old_ablations;
ALTER TABLE ablation_runs RENAME TO old_ablation_runs;
ALTER TABLE episode_summaries RENAME TO old_episode_summaries;

-- The queue. A unit is claimed by a lease of seconds: `claimable_at` is when it may be claimed (again),
-- be it queued, held back after a failure, or leased to a worker that must renew. What it is for, the
-- tables say that refer to it, so that a new kind of work changes nothing here.
CREATE TABLE units (
    queue_no     INTEGER NOT NULL PRIMARY KEY,
    id           TEXT    NOT NULL UNIQUE,
    kind         TEXT    NOT NULL,
    urgency      INTEGER NOT NULL,  -- the smaller comes first
    state        TEXT    NOT NULL CHECK (state IN ('queued', 'leased', 'done', 'dropped')),
    claimable_at INTEGER NOT NULL,
    -- leases given, less the ones handed back at a shutdown
    attempts     INTEGER NOT NULL DEFAULT 0 CHECK (attempts >= 0),
    -- attempts that ended by a reported fault of ours
    failures     INTEGER NOT NULL DEFAULT 0 CHECK (failures >= 0),
    worker       TEXT    CHECK (worker IS NOT NULL OR state NOT IN ('leased', 'done')),
    -- proof of the lease; kept when done, so that its holder may commit again without harm
    nonce        TEXT    CHECK ((nonce IS NOT NULL) = (state IN ('leased', 'done'))),
    -- in whatever the work counts; episodes of a shard
    progress     INTEGER NOT NULL DEFAULT 0 CHECK (progress >= 0)
) STRICT;

-- Contestants, a profile and episodes, cut into shards. An evaluation owns one, an ablation six.
CREATE TABLE runs (
    id                 TEXT    NOT NULL PRIMARY KEY,
    profile            TEXT    NOT NULL,
    seed               TEXT    NOT NULL,  -- label: a UTC day, or 'ablation'
    tasks              TEXT    NOT NULL,  -- JSON array, in the order of play
    episodes_per_task  INTEGER NOT NULL CHECK (episodes_per_task > 0),
    episodes_per_shard INTEGER NOT NULL CHECK (episodes_per_shard > 0),
    max_faults         INTEGER NOT NULL CHECK (max_faults >= 0),
    keeps_recordings   INTEGER NOT NULL CHECK (keeps_recordings IN (0, 1)),
    -- stopped: its owner ended before all shards were committed, or because of what they hold
    state              TEXT    NOT NULL CHECK (state IN ('queued', 'running', 'played', 'stopped')),
    -- when the artifacts of its shards were removed, once its owner was over
    recordings_removed_at INTEGER CHECK (recordings_removed_at IS NULL OR keeps_recordings = 1)
) STRICT;

CREATE TABLE contestants (
    run_id        TEXT    NOT NULL REFERENCES runs (id),
    side          INTEGER NOT NULL CHECK (side >= 0),
    submission_id TEXT    NOT NULL REFERENCES submissions (id),
    PRIMARY KEY (run_id, side)
) STRICT, WITHOUT ROWID;

-- A range of episodes of one task. The large columns come last: a list of shards does not read them.
CREATE TABLE shards (
    id            TEXT    NOT NULL PRIMARY KEY,
    run_id        TEXT    NOT NULL REFERENCES runs (id),
    unit_id       TEXT    NOT NULL UNIQUE REFERENCES units (id),
    -- position in the run: task by task, first episode by first episode
    position      INTEGER NOT NULL CHECK (position >= 0),
    task          TEXT    NOT NULL,
    first_episode INTEGER NOT NULL CHECK (first_episode >= 0),
    end_episode   INTEGER NOT NULL CHECK (end_episode > first_episode),
    -- set together by the one commit; no recording where the run keeps none
    committed_at  INTEGER,
    recording     TEXT    CHECK (recording IS NULL OR committed_at IS NOT NULL),  -- artifact key prefix
    agent_faults  INTEGER CHECK ((agent_faults IS NULL) = (committed_at IS NULL)),
    outcomes      TEXT    CHECK ((outcomes IS NULL) = (committed_at IS NULL)),    -- JSON
    log           TEXT    CHECK ((log IS NULL) = (committed_at IS NULL)),
    UNIQUE (run_id, position),
    UNIQUE (run_id, task, first_episode)
) STRICT;

CREATE TABLE smoke_runs (
    submission_id TEXT NOT NULL PRIMARY KEY REFERENCES submissions (id),
    unit_id       TEXT NOT NULL UNIQUE REFERENCES units (id)
) STRICT, WITHOUT ROWID;

-- While an evaluation is open, how far it is is its run's state.
CREATE TABLE evaluations (
    id             TEXT    NOT NULL PRIMARY KEY,
    submission_id  TEXT    NOT NULL REFERENCES submissions (id),
    team_id        TEXT    NOT NULL REFERENCES teams (id),
    day            TEXT    NOT NULL,
    run_id         TEXT    NOT NULL UNIQUE REFERENCES runs (id),
    created_at     INTEGER NOT NULL,
    state          TEXT    NOT NULL CHECK (state IN ('open', 'finished', 'agent_failed', 'platform_failed',
                                                     'cancelled')),
    finished_at    INTEGER CHECK ((finished_at IS NULL) = (state = 'open')),
    reason         TEXT    CHECK ((reason IS NOT NULL) = (state IN ('platform_failed', 'cancelled'))),
    dataset        TEXT    CHECK ((dataset IS NOT NULL) = (state = 'finished')),     -- artifact key
    -- of the archive; unknown of those made by older programs
    dataset_blake3 TEXT    CHECK (dataset_blake3 IS NULL OR state = 'finished'),
    result         TEXT    CHECK ((result IS NOT NULL) = (state = 'finished'))       -- JSON
) STRICT;

CREATE TABLE finalisations (
    evaluation_id TEXT NOT NULL PRIMARY KEY REFERENCES evaluations (id),
    unit_id       TEXT NOT NULL UNIQUE REFERENCES units (id)
) STRICT, WITHOUT ROWID;

-- A submission under each perturbation alone. They take no turn and reach no board, so they are no
-- evaluations; their runs are the queue's last.
CREATE TABLE ablations (
    id            TEXT    NOT NULL PRIMARY KEY,
    submission_id TEXT    NOT NULL REFERENCES submissions (id),
    created_at    INTEGER NOT NULL,
    finished_at   INTEGER,
    -- why it ended without a result
    reason        TEXT    CHECK (reason IS NULL OR finished_at IS NOT NULL)
) STRICT;

CREATE TABLE ablation_runs (
    ablation_id TEXT NOT NULL REFERENCES ablations (id),
    run_id      TEXT NOT NULL UNIQUE REFERENCES runs (id),
    PRIMARY KEY (ablation_id, run_id)
) STRICT, WITHOUT ROWID;

-- What boards and comparisons need of a run's episodes, made once from its shards' outcomes.
-- Derived data: it may be removed at any time, and one of another version is made again.
CREATE TABLE episode_summaries (
    run_id  TEXT    NOT NULL PRIMARY KEY REFERENCES runs (id),
    version INTEGER NOT NULL,
    summary TEXT    NOT NULL  -- JSON; the scoring's
) STRICT;

-- What happened, in the order in which it was committed. Nothing is ever changed or removed here;
-- AUTOINCREMENT, so that an id is never given twice.
CREATE TABLE events (
    id           INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT,
    at           INTEGER NOT NULL,
    actor        TEXT    NOT NULL,
    subject_kind TEXT    NOT NULL,
    subject_id   TEXT    NOT NULL,
    kind         TEXT    NOT NULL,
    payload      TEXT    NOT NULL  -- JSON
) STRICT;

-- The queue and the checked uploads.
INSERT INTO units (queue_no, id, kind, urgency, state, claimable_at, attempts, failures, worker, nonce, progress)
SELECT queue_no, id, CASE kind WHEN 'ablation' THEN 'shard' ELSE kind END, urgency, state, claimable_at,
       attempts, failures, worker, nonce, episodes_done
FROM old_work_units;

INSERT INTO smoke_runs (submission_id, unit_id)
SELECT submission_id, id FROM old_work_units WHERE kind = 'smoke';

-- An evaluation's run takes the evaluation's id, which the keys of its recordings hold.
INSERT INTO runs (id, profile, seed, tasks, episodes_per_task, episodes_per_shard, max_faults,
                  keeps_recordings, state, recordings_removed_at)
SELECT e.id, e.profile, e.day, e.tasks, e.episodes_per_task, e.episodes_per_shard, e.max_faults, 1,
       CASE WHEN e.state = 'agent_failed' THEN 'stopped'
            WHEN NOT EXISTS (SELECT 1 FROM old_shards s
                             WHERE s.evaluation_id = e.id AND s.committed_at IS NULL) THEN 'played'
            WHEN e.state IN ('queued', 'running') THEN e.state
            ELSE 'stopped' END,
       e.recordings_removed_at
FROM old_evaluations e;

INSERT INTO contestants (run_id, side, submission_id)
SELECT id, 0, submission_id FROM old_evaluations;

INSERT INTO shards (id, run_id, unit_id, position, task, first_episode, end_episode, committed_at,
                    recording, agent_faults, outcomes, log)
SELECT s.id, s.evaluation_id, u.id, s.position, s.task, s.first_episode, s.end_episode, s.committed_at,
       s.recording, s.agent_faults, s.outcomes, s.log
FROM old_shards s JOIN old_work_units u ON u.shard_id = s.id;

INSERT INTO evaluations (id, submission_id, team_id, day, run_id, created_at, state, finished_at, reason,
                         dataset, result)
SELECT id, submission_id, team_id, day, id, created_at,
       CASE WHEN state IN ('queued', 'running', 'finalising') THEN 'open' ELSE state END,
       finished_at, reason, dataset, result
FROM old_evaluations;

INSERT INTO finalisations (evaluation_id, unit_id)
SELECT evaluation_id, id FROM old_work_units WHERE kind = 'finalise';

INSERT INTO episode_summaries (run_id, version, summary)
SELECT evaluation_id, version, summary FROM old_episode_summaries;

-- An ablation had a run per profile and task: now one per profile, with a shard per task. The run takes
-- the smallest of the three ids.
INSERT INTO ablations (id, submission_id, created_at, finished_at, reason)
SELECT id, submission_id, created_at, finished_at, reason FROM old_ablations;

CREATE TEMPORARY TABLE joined AS
SELECT r.id AS shard_id, MIN(r.id) OVER (PARTITION BY r.ablation_id, r.profile) AS run_id
FROM old_ablation_runs r;

INSERT INTO runs (id, profile, seed, tasks, episodes_per_task, episodes_per_shard, max_faults,
                  keeps_recordings, state)
SELECT j.run_id, r.profile, 'ablation', '["hit","defend","prepare"]', a.episodes_per_task,
       a.episodes_per_task, a.max_faults, 0,
       CASE WHEN COUNT(r.outcomes) = COUNT(*) THEN 'played'
            WHEN a.finished_at IS NOT NULL THEN 'stopped'
            WHEN MAX(u.attempts) > 0 THEN 'running'
            ELSE 'queued' END
FROM joined j
JOIN old_ablation_runs r ON r.id = j.shard_id
JOIN old_ablations a ON a.id = r.ablation_id
JOIN old_work_units u ON u.ablation_run_id = r.id
GROUP BY j.run_id;

INSERT INTO ablation_runs (ablation_id, run_id)
SELECT r.ablation_id, r.id FROM old_ablation_runs r WHERE r.id IN (SELECT run_id FROM joined);

INSERT INTO contestants (run_id, side, submission_id)
SELECT r.run_id, 0, a.submission_id FROM ablation_runs r JOIN ablations a ON a.id = r.ablation_id;

INSERT INTO shards (id, run_id, unit_id, position, task, first_episode, end_episode, committed_at,
                    agent_faults, outcomes, log)
SELECT r.id, j.run_id, u.id, CASE r.task WHEN 'hit' THEN 0 WHEN 'defend' THEN 1 ELSE 2 END, r.task, 0,
       a.episodes_per_task,
       -- when it was played was not noted: between the order and the end
       CASE WHEN r.outcomes IS NOT NULL THEN COALESCE(a.finished_at, a.created_at) END,
       CASE WHEN r.outcomes IS NOT NULL THEN
           (SELECT COUNT(*) FROM json_each(r.outcomes) o
            WHERE json_extract(o.value, '$.fault') IS NOT NULL) END,
       r.outcomes,
       CASE WHEN r.outcomes IS NOT NULL THEN '' END
FROM joined j
JOIN old_ablation_runs r ON r.id = j.shard_id
JOIN old_ablations a ON a.id = r.ablation_id
JOIN old_work_units u ON u.ablation_run_id = r.id;

-- A run that the agent's faults stopped was done without outcomes; a unit is done if and only if its
-- shard is committed.
UPDATE units SET state = 'dropped', nonce = NULL
WHERE state = 'done' AND id IN (SELECT unit_id FROM shards WHERE committed_at IS NULL);

DROP TABLE joined;
DROP TABLE old_episode_summaries;
DROP TABLE old_work_units;
DROP TABLE old_shards;
DROP TABLE old_ablation_runs;
DROP TABLE old_ablations;
DROP TABLE old_evaluations;

CREATE INDEX units_open ON units (urgency, queue_no) WHERE state IN ('queued', 'leased');

-- One counting evaluation per team and UTC day. A run that we broke or cancelled gives the turn back.
CREATE UNIQUE INDEX one_turn_per_team_and_day ON evaluations (team_id, day)
    WHERE state NOT IN ('platform_failed', 'cancelled');
-- with the state, so that the finished ones of all days are counted without reading the rows
CREATE INDEX evaluations_of_day ON evaluations (day, created_at, state);
CREATE INDEX evaluations_of_team ON evaluations (team_id, created_at);
-- the board: the newest finished day of each team
CREATE INDEX evaluations_on_the_board ON evaluations (team_id, day DESC) WHERE state = 'finished';
CREATE INDEX evaluations_open ON evaluations (day) WHERE state = 'open';

CREATE INDEX ablations_of_submission ON ablations (submission_id, created_at);
CREATE UNIQUE INDEX one_open_ablation_per_submission ON ablations (submission_id) WHERE finished_at IS NULL;

-- recordings that are still kept
CREATE INDEX runs_with_recordings ON runs (id) WHERE keeps_recordings = 1 AND recordings_removed_at IS NULL;

CREATE INDEX events_of_subject ON events (subject_kind, subject_id, id);
