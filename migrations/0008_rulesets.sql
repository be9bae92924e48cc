-- By which rules a run is played and scored. What is there when this arrives was begun under the first,
-- and is finished under them.
ALTER TABLE runs ADD COLUMN ruleset TEXT NOT NULL DEFAULT 'airhockey-2023.1';

CREATE INDEX runs_of_ruleset ON runs (ruleset);
