-- The runtime that an agent's manifest names; not known of what was checked before there was this column.
ALTER TABLE submissions ADD COLUMN runtime TEXT;
