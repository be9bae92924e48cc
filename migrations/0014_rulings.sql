-- What the organiser has decided against results and teams, each with a reason that everybody may read.

ALTER TABLE teams ADD COLUMN disqualified_at INTEGER;
ALTER TABLE teams ADD COLUMN disqualified_for TEXT CHECK ((disqualified_for IS NULL) = (disqualified_at IS NULL));

-- It stands on no board, and the turn is given back.
ALTER TABLE evaluations ADD COLUMN voided_at INTEGER
    CHECK (voided_at IS NULL OR state IN ('finished', 'agent_failed'));
ALTER TABLE evaluations ADD COLUMN voided_for TEXT CHECK ((voided_for IS NULL) = (voided_at IS NULL));

DROP INDEX one_turn_per_team_and_day;
CREATE UNIQUE INDEX one_turn_per_team_and_day ON evaluations (team_id, stage_id, day)
    WHERE state NOT IN ('platform_failed', 'cancelled') AND voided_at IS NULL;
DROP INDEX evaluations_on_the_board;
CREATE INDEX evaluations_on_the_board ON evaluations (team_id, stage_id, revision, day DESC)
    WHERE state = 'finished' AND voided_at IS NULL;
DROP INDEX evaluations_of_revision;
CREATE INDEX evaluations_of_revision ON evaluations (stage_id, revision)
    WHERE state = 'finished' AND voided_at IS NULL;
DROP INDEX evaluations_of_day;
CREATE INDEX evaluations_of_day ON evaluations (stage_id, day, created_at, state, voided_at);
