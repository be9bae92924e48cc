-- A refused bundle is nobody's: its archive goes, and the row keeps reason, log and hash. Until then, and
-- for all that may still play, the archive counts towards what its team has stored.
ALTER TABLE submissions ADD COLUMN bundle_removed_at INTEGER
    CHECK (bundle_removed_at IS NULL OR state IN ('invalid', 'validation_error'));

-- What is to be removed is few at any time.
CREATE INDEX refused_bundles ON submissions (id)
    WHERE bundle_removed_at IS NULL AND state IN ('invalid', 'validation_error');
CREATE INDEX contestants_of_submission ON contestants (submission_id);
