-- The competition that a season belongs to, and a hash of what its scores depend on. A server of an earlier version did not
-- store them.

ALTER TABLE season ADD COLUMN competition_id TEXT;
ALTER TABLE season ADD COLUMN competition_hash TEXT CHECK ((competition_hash IS NULL) = (competition_id IS NULL));
