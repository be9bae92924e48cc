-- Reference agents of the organisers stand on boards without taking a rank from anybody.
ALTER TABLE teams ADD COLUMN is_baseline INTEGER NOT NULL DEFAULT 0 CHECK (is_baseline IN (0, 1));
