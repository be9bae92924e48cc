-- The key that a client has chosen for an upload (header Idempotency-Key): a second upload with it creates nothing.
ALTER TABLE submissions ADD COLUMN idempotency_key TEXT;
CREATE UNIQUE INDEX submissions_by_idempotency_key ON submissions (team_id, idempotency_key)
    WHERE idempotency_key IS NOT NULL;
