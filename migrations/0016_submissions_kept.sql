-- What a team says of its submissions, and which of them it has taken back: those enter no further day.
ALTER TABLE submissions ADD COLUMN withdrawn_at INTEGER;
ALTER TABLE submissions ADD COLUMN label TEXT;

-- The same archive, uploaded before.
CREATE INDEX submissions_of_archive ON submissions (team_id, bundle_blake3, created_at, id);
