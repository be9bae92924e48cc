-- How long an upload's answers took in its smoke run: JSON, for each task that was played. NULL before
-- the run is over, and for those that were over before this column.
ALTER TABLE submissions ADD COLUMN timing TEXT;
