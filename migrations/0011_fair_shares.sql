-- Slots are shared. Work waits in lanes, and in a lane for whoever it is done for: the lane that was served
-- least is next, and in it the account that was served least. What a lease takes of a slot is charged to both.

CREATE TABLE lanes (
    lane      TEXT    NOT NULL PRIMARY KEY,
    urgency   INTEGER NOT NULL,  -- the smaller comes first, whatever was served
    rank      INTEGER NOT NULL,  -- of two lanes that were served alike, the smaller comes first
    -- slot time, milliseconds; what comes back after a pause starts beside the least served that waits
    served_ms INTEGER NOT NULL CHECK (served_ms >= 0)
) STRICT, WITHOUT ROWID;

CREATE TABLE accounts (
    account_no INTEGER NOT NULL PRIMARY KEY,
    lane       TEXT    NOT NULL REFERENCES lanes (lane),
    holder     TEXT    NOT NULL,  -- whoever the work is done for; the queue does not know who that is
    served_ms  INTEGER NOT NULL CHECK (served_ms >= 0),
    UNIQUE (lane, holder)
) STRICT;

INSERT INTO lanes (lane, urgency, rank, served_ms) VALUES
    ('finalise', 0, 0, 0), ('smoke', 1, 0, 0), ('shard', 1, 1, 0), ('ablation', 2, 0, 0);

-- Of an account, none of which is ever removed; NULL of what was over before there were accounts. As a
-- declared reference it would have SQLite look through all units for orphans when an account is opened.
ALTER TABLE units ADD COLUMN account_no INTEGER;
-- Of the lease that it is under, or was done under.
ALTER TABLE units ADD COLUMN charged_ms INTEGER NOT NULL DEFAULT 0 CHECK (charged_ms >= 0);

CREATE TEMPORARY TABLE open_work AS
SELECT u.id AS unit_id,
       CASE WHEN u.urgency = 3 THEN 'ablation' ELSE u.kind END AS lane,
       COALESCE((SELECT s.team_id FROM smoke_runs r JOIN submissions s ON s.id = r.submission_id
                 WHERE r.unit_id = u.id),
                (SELECT s.team_id FROM shards h JOIN contestants c ON c.run_id = h.run_id
                 JOIN submissions s ON s.id = c.submission_id WHERE h.unit_id = u.id ORDER BY c.side LIMIT 1),
                '') AS holder
FROM units u WHERE u.state IN ('queued', 'leased');

INSERT INTO accounts (lane, holder, served_ms)
SELECT DISTINCT lane, holder, 0 FROM open_work ORDER BY lane, holder;

UPDATE units SET account_no =
    (SELECT a.account_no FROM open_work o JOIN accounts a ON a.lane = o.lane AND a.holder = o.holder
     WHERE o.unit_id = units.id)
WHERE state IN ('queued', 'leased');

DROP TABLE open_work;

-- From now on in the lane.
DROP INDEX units_open;
ALTER TABLE units DROP COLUMN urgency;
CREATE INDEX units_open ON units (account_no, queue_no, claimable_at) WHERE state IN ('queued', 'leased');

CREATE TRIGGER slot_time_is_charged AFTER UPDATE OF charged_ms ON units
    WHEN NEW.charged_ms <> OLD.charged_ms
    BEGIN
        UPDATE accounts SET served_ms = served_ms + NEW.charged_ms - OLD.charged_ms
        WHERE account_no = NEW.account_no;
        UPDATE lanes SET served_ms = served_ms + NEW.charged_ms - OLD.charged_ms
        WHERE lane = (SELECT lane FROM accounts WHERE account_no = NEW.account_no);
    END;
