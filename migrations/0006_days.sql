-- A day has one cut, when it starts: what each team has active then plays it, and nothing else. When the last
-- evaluation of the day has ended, all of the day is released at once.

CREATE TABLE days (
    day         TEXT    NOT NULL PRIMARY KEY,
    cut_at      INTEGER NOT NULL,
    -- when its seed, its datasets and its logs were given to those they belong to
    released_at INTEGER
) STRICT, WITHOUT ROWID;

CREATE TRIGGER a_cut_stays_where_it_is BEFORE UPDATE OF day, cut_at ON days
    BEGIN SELECT RAISE(ABORT, 'the day has had its cut'); END;
CREATE TRIGGER a_released_day_stays_released BEFORE UPDATE OF released_at ON days
    WHEN OLD.released_at IS NOT NULL
    BEGIN SELECT RAISE(ABORT, 'the day is released'); END;

-- Days of before began with their first evaluation. They were released by the first dataset that was handed
-- out; from now on by the end of the last evaluation, which of some has come already.
INSERT INTO days (day, cut_at, released_at)
SELECT e.day, MIN(e.created_at),
       COALESCE((SELECT r.released_at FROM released_days r WHERE r.day = e.day),
                CASE WHEN SUM(e.state = 'open') = 0 THEN MAX(e.finished_at) END)
FROM evaluations e GROUP BY e.day;

-- A day that the schedule started although no team had anything to play.
INSERT INTO days (day, cut_at, released_at)
SELECT last_scheduled_day, 1000 * unixepoch(last_scheduled_day), 1000 * unixepoch(last_scheduled_day)
FROM season
WHERE last_scheduled_day IS NOT NULL AND last_scheduled_day NOT IN (SELECT day FROM days);

DROP TABLE released_days;
ALTER TABLE season DROP COLUMN last_scheduled_day;

-- What a team enters at the next cut.
CREATE TABLE active_submissions (
    team_id       TEXT    NOT NULL PRIMARY KEY REFERENCES teams (id),
    submission_id TEXT    NOT NULL REFERENCES submissions (id),
    -- what was uploaded before this does not take its place, however late it turns valid
    since         INTEGER NOT NULL
) STRICT, WITHOUT ROWID;

INSERT INTO active_submissions (team_id, submission_id, since)
SELECT s.team_id, s.id, s.created_at FROM submissions s
WHERE s.state = 'valid'
  AND NOT EXISTS (SELECT 1 FROM submissions n
                  WHERE n.team_id = s.team_id AND n.state = 'valid'
                    AND (n.created_at, n.id) > (s.created_at, s.id));

-- Which evaluation it plays again: one that we broke, or that was cancelled.
ALTER TABLE evaluations ADD COLUMN rerun_of TEXT REFERENCES evaluations (id);
