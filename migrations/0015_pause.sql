-- The organiser may hold the queue: nothing is begun, what is begun is played to its end.
ALTER TABLE season ADD COLUMN paused_at INTEGER;
ALTER TABLE season ADD COLUMN paused_for TEXT CHECK ((paused_for IS NULL) = (paused_at IS NULL));
