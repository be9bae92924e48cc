-- What is kept of a stage's datasets, and what has gone.

-- JSON; a stage without a row keeps everything. Beside the stages: no score depends on it, and it may become another
-- after the sign-off.
CREATE TABLE stage_retentions (
    stage_id  TEXT NOT NULL PRIMARY KEY REFERENCES stages (id),
    retention TEXT NOT NULL
) STRICT, WITHOUT ROWID;

-- Size of the dataset's archive; NULL: not measured yet.
ALTER TABLE evaluations ADD COLUMN dataset_bytes INTEGER
    CHECK (dataset_bytes IS NULL OR dataset_bytes >= 0 AND state = 'finished');
-- The row goes first: from then on nobody is promised the dataset. The file follows, and then it is noted as gone, so
-- that a kill in between leaves neither a promise that is broken nor a file that nobody looks for.
ALTER TABLE evaluations ADD COLUMN dataset_removed_at INTEGER
    CHECK (dataset_removed_at IS NULL OR state = 'finished');
ALTER TABLE evaluations ADD COLUMN dataset_removed_for TEXT
    CHECK ((dataset_removed_for IS NULL) = (dataset_removed_at IS NULL));
ALTER TABLE evaluations ADD COLUMN dataset_gone INTEGER NOT NULL DEFAULT 0
    CHECK (dataset_gone = 0 OR dataset_gone = 1 AND dataset_removed_at IS NOT NULL);
ALTER TABLE drafts ADD COLUMN dataset_bytes INTEGER
    CHECK (dataset_bytes IS NULL OR dataset_bytes >= 0 AND state = 'finished');

CREATE INDEX datasets_going ON evaluations (id) WHERE dataset_removed_at IS NOT NULL AND dataset_gone = 0;
CREATE INDEX datasets_unmeasured ON evaluations (id)
    WHERE state = 'finished' AND dataset_bytes IS NULL AND dataset_removed_at IS NULL;
CREATE INDEX drafts_unmeasured ON drafts (id)
    WHERE state = 'finished' AND dataset_bytes IS NULL AND dataset_removed_at IS NULL;
-- how much room a team's datasets take
CREATE INDEX datasets_of_team ON evaluations (team_id, stage_id, day, dataset_bytes)
    WHERE state = 'finished' AND dataset_removed_at IS NULL;

-- Whom an organiser has taken out of the season: what it has uploaded and played is kept for the organisers.
ALTER TABLE teams ADD COLUMN retired_by_organiser INTEGER NOT NULL DEFAULT 0
    CHECK (retired_by_organiser = 0 OR retired_by_organiser = 1 AND retired_at IS NOT NULL);
UPDATE teams SET retired_by_organiser = 1
WHERE retired_at IS NOT NULL
  AND (SELECT e.actor = 'organiser'
              OR EXISTS (SELECT 1 FROM people p WHERE 'person:' || p.id = e.actor AND p.team_id IS NULL)
       FROM events e
       WHERE e.subject_kind = 'team' AND e.subject_id = teams.id AND e.kind = 'team_retired'
       ORDER BY e.id DESC LIMIT 1);
