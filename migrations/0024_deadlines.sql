-- A day may be played until its deadline, older days first; what is left then is ended as not played, by our fault
-- and nobody's.

-- NULL: however long it takes, as all days from before there were deadlines.
ALTER TABLE days ADD COLUMN deadline_at INTEGER CHECK (deadline_at > cut_at);

-- A cancelled one that had no time left. (A state of its own would be another table: its states are fixed.)
ALTER TABLE evaluations ADD COLUMN unplayed INTEGER NOT NULL DEFAULT 0
    CHECK (unplayed = 0 OR unplayed = 1 AND state = 'cancelled');

-- Slot time that a finished one took, milliseconds; unknown of those that older programs finished.
ALTER TABLE evaluations ADD COLUMN slot_ms INTEGER CHECK (slot_ms >= 0);

-- Of a lane, units of a smaller batch are served first, whoever they are of.
ALTER TABLE units ADD COLUMN batch INTEGER NOT NULL DEFAULT 0;
DROP INDEX units_open;
CREATE INDEX units_open ON units (account_no, batch, queue_no, claimable_at) WHERE state IN ('queued', 'leased');

-- The newest uploads, by which the time of a smoke run is measured.
CREATE INDEX submissions_by_time ON submissions (created_at);

-- What is under way goes on in the order of its days' cuts.
UPDATE units SET batch = COALESCE(
    (SELECT d.cut_at FROM shards s JOIN evaluations e ON e.run_id = s.run_id
     JOIN days d ON d.stage_id = e.stage_id AND d.day = e.day WHERE s.unit_id = units.id), 0)
WHERE state IN ('queued', 'leased');
