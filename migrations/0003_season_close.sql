-- The end of the season: from then on its secret is public and nothing more is evaluated.
ALTER TABLE season ADD COLUMN closed_at INTEGER;

CREATE TRIGGER a_closed_season_stays_closed BEFORE UPDATE OF closed_at ON season
    WHEN OLD.closed_at IS NOT NULL AND NEW.closed_at IS NOT OLD.closed_at
    BEGIN SELECT RAISE(ABORT, 'the season is closed'); END;

-- Days whose seed has left the server, with the first dataset that carries it. From then on a new
-- evaluation of the day takes only submissions that were uploaded before.
CREATE TABLE released_days (
    day         TEXT    NOT NULL PRIMARY KEY,
    released_at INTEGER NOT NULL
) STRICT;
