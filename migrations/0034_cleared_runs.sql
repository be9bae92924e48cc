-- A season's database keeps what is asked for: of a run that is over, its episodes' summary and its owner's result.
-- Its shards without faults, their units of work and what was told of each go a day after its end, for a backup that
-- was begun before; whoever wants single episodes has the dataset.
ALTER TABLE runs ADD COLUMN cleared_at INTEGER;

-- what is to be cleared is few at any time
CREATE INDEX runs_to_clear ON runs (id) WHERE cleared_at IS NULL;
