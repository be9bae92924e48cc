-- The newest event that boards depend on: what a day's play adds is no change of them, and there are thousands of it.
CREATE INDEX events_of_change ON events (id) WHERE kind NOT IN ('shard_committed', 'unit_given_back');
