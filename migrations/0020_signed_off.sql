-- A stage's result is provisional until the organiser has signed it off; after that nothing of it changes.

ALTER TABLE stages ADD COLUMN finalised_at INTEGER;
ALTER TABLE stages ADD COLUMN finalised_by TEXT CHECK ((finalised_by IS NULL) = (finalised_at IS NULL));
-- JSON: the teams that were disqualified then, and so are not ranked whatever becomes of them
ALTER TABLE stages ADD COLUMN finalised_without TEXT CHECK ((finalised_without IS NULL) = (finalised_at IS NULL));

CREATE TRIGGER a_final_stage_stays_as_it_is BEFORE UPDATE ON stages WHEN OLD.finalised_at IS NOT NULL
    BEGIN SELECT RAISE(ABORT, 'the stage is signed off'); END;
CREATE TRIGGER a_final_result_is_not_voided BEFORE UPDATE OF voided_at, result, state ON evaluations
    WHEN EXISTS (SELECT 1 FROM stages s WHERE s.id = OLD.stage_id AND s.finalised_at IS NOT NULL)
    BEGIN SELECT RAISE(ABORT, 'the stage is signed off'); END;

-- One last cut after the close, in a stage whose standings are those of a final evaluation.
ALTER TABLE days ADD COLUMN is_final INTEGER NOT NULL DEFAULT 0 CHECK (is_final IN (0, 1));
CREATE UNIQUE INDEX one_final_day ON days (stage_id) WHERE is_final = 1;

-- Its team has made its dataset public before the stage did.
ALTER TABLE evaluations ADD COLUMN published_at INTEGER CHECK (published_at IS NULL OR state = 'finished');
