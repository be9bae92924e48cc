-- The public archive has the questions that everybody may read, without who asked.
CREATE TABLE new_questions (
    id          TEXT    NOT NULL PRIMARY KEY,
    -- NULL: in a public archive
    team_id     TEXT    REFERENCES teams (id),
    asked_at    INTEGER NOT NULL,
    text        TEXT    NOT NULL,
    answer      TEXT    CHECK ((answer IS NULL) = (answered_at IS NULL)),
    answered_at INTEGER,
    -- may everybody read question and answer? The team's name stays with the organisers
    public      INTEGER NOT NULL DEFAULT 0 CHECK (public IN (0, 1)),
    CHECK (public = 0 OR answer IS NOT NULL)
) STRICT;
INSERT INTO new_questions SELECT id, team_id, asked_at, text, answer, answered_at, public FROM questions;
DROP TABLE questions;
ALTER TABLE new_questions RENAME TO questions;
CREATE INDEX questions_of_team ON questions (team_id, asked_at);
