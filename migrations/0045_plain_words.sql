-- Tables and columns get the names of the things that they hold. SQLite adapts references, indexes and triggers. It
-- does not rename these, so those with an old word in their name are made again. Stored values do not change.

ALTER TABLE units RENAME TO jobs;
ALTER TABLE smoke_runs RENAME TO validation_runs;
ALTER TABLE finalisations RENAME TO scorings;
ALTER TABLE drafts RENAME TO proposed_evaluations;
ALTER TABLE draft_finalisations RENAME TO proposed_evaluation_scorings;

ALTER TABLE shards RENAME COLUMN unit_id TO job_id;
ALTER TABLE games RENAME COLUMN unit_id TO job_id;
ALTER TABLE validation_runs RENAME COLUMN unit_id TO job_id;
ALTER TABLE scorings RENAME COLUMN unit_id TO job_id;
ALTER TABLE proposed_evaluation_scorings RENAME COLUMN unit_id TO job_id;
ALTER TABLE proposed_evaluation_scorings RENAME COLUMN draft_id TO proposed_evaluation_id;
ALTER TABLE games RENAME COLUMN meeting TO pairing;
ALTER TABLE days RENAME COLUMN cut_at TO cutoff_at;

DROP TRIGGER a_cut_stays_where_it_is;
CREATE TRIGGER a_cutoff_stays_where_it_is BEFORE UPDATE OF stage_id, day, cutoff_at ON days
    BEGIN SELECT RAISE(ABORT, 'the day had its cutoff'); END;

DROP INDEX units_open;
CREATE INDEX jobs_open ON jobs (account_no, batch, queue_no, claimable_at) WHERE state IN ('queued', 'leased');
-- Jobs that remote workers have done, by the names of their slots: `remote/WORKER/SLOT`.
DROP INDEX units_played_elsewhere;
CREATE INDEX jobs_done_remotely ON jobs (worker)
    WHERE state = 'done' AND worker >= 'remote/' AND worker < 'remote0';

DROP INDEX drafts_of_proposal;
CREATE INDEX proposed_evaluations_of_proposal ON proposed_evaluations (proposal_id, created_at);
DROP INDEX drafts_of_submission;
CREATE INDEX proposed_evaluations_of_submission ON proposed_evaluations (submission_id);
DROP INDEX drafts_open;
CREATE INDEX proposed_evaluations_open ON proposed_evaluations (proposal_id) WHERE state = 'open';
DROP INDEX drafts_over;
CREATE INDEX proposed_evaluations_ended ON proposed_evaluations (finished_at) WHERE finished_at IS NOT NULL;
DROP INDEX drafts_unmeasured;
CREATE INDEX proposed_evaluations_unmeasured ON proposed_evaluations (id)
    WHERE state = 'finished' AND dataset_bytes IS NULL AND dataset_removed_at IS NULL;

DROP INDEX one_turn_per_team_and_day;
CREATE UNIQUE INDEX one_evaluation_per_team_and_day ON evaluations (team_id, stage_id, day, revision)
    WHERE state NOT IN ('platform_failed', 'cancelled') AND voided_at IS NULL;
