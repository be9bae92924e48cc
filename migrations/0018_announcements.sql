-- What is told to everybody, and what teams ask.

CREATE TABLE announcements (
    id    TEXT    NOT NULL PRIMARY KEY,
    at    INTEGER NOT NULL,
    title TEXT    NOT NULL,
    text  TEXT    NOT NULL
) STRICT;

CREATE INDEX announcements_by_time ON announcements (at);

CREATE TABLE questions (
    id          TEXT    NOT NULL PRIMARY KEY,
    team_id     TEXT    NOT NULL REFERENCES teams (id),
    asked_at    INTEGER NOT NULL,
    text        TEXT    NOT NULL,
    answer      TEXT    CHECK ((answer IS NULL) = (answered_at IS NULL)),
    answered_at INTEGER,
    -- may everybody read question and answer? The team's name stays with the organisers
    public      INTEGER NOT NULL DEFAULT 0 CHECK (public IN (0, 1)),
    CHECK (public = 0 OR answer IS NOT NULL)
) STRICT;

CREATE INDEX questions_of_team ON questions (team_id, asked_at);
