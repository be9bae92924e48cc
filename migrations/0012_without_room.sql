-- How often a unit found no room on a disk that has as much as is to be kept free: what it needs may never be there.
ALTER TABLE units ADD COLUMN without_room INTEGER NOT NULL DEFAULT 0 CHECK (without_room >= 0);
