-- What the organiser does with days and boards, each with a reason that everybody may read.

-- Boards that show what they showed then.
CREATE TABLE frozen_boards (
    stage_id  TEXT    NOT NULL PRIMARY KEY REFERENCES stages (id),
    frozen_at INTEGER NOT NULL,
    reason    TEXT    NOT NULL
) STRICT, WITHOUT ROWID;

-- Why the day was played later than on its date, with what was active at its cut.
ALTER TABLE days ADD COLUMN missed_for TEXT;

-- Why it is a turn beside the day's own.
ALTER TABLE evaluations ADD COLUMN extra_for TEXT;
