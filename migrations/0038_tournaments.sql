-- Tournaments: rounds of games between submissions. The tables say who is in, what was drawn, and how each game stands;
-- who wins what is the scoring's.

CREATE TABLE tournaments (
    id          TEXT    NOT NULL PRIMARY KEY,
    -- its seeds follow from it, so that the same season played again has the same ones
    number      INTEGER NOT NULL UNIQUE CHECK (number > 0),
    name        TEXT    NOT NULL UNIQUE COLLATE NOCASE,
    created_at  INTEGER NOT NULL,
    -- whose tiers the first entrants come from
    stage_id    TEXT    REFERENCES stages (id),
    rules       TEXT    NOT NULL,  -- JSON
    settings    TEXT    NOT NULL,  -- JSON
    baseline_id TEXT    REFERENCES submissions (id),
    paused_at   INTEGER,
    paused_for  TEXT    CHECK ((paused_for IS NULL) = (paused_at IS NULL)),
    closed_at   INTEGER
) STRICT;

CREATE TABLE entrants (
    tournament_id TEXT    NOT NULL REFERENCES tournaments (id),
    team_id       TEXT    NOT NULL REFERENCES teams (id),
    entered_at    INTEGER NOT NULL,
    left_as       TEXT    CHECK (left_as IN ('withdrawn', 'disqualified')),
    -- the first round whose games with it do not count
    from_round    INTEGER CHECK ((from_round IS NULL) = (left_as IS NULL)),
    left_at       INTEGER CHECK ((left_at IS NULL) = (left_as IS NULL)),
    left_for      TEXT    CHECK ((left_for IS NULL) = (left_as IS NULL)),
    PRIMARY KEY (tournament_id, team_id)
) STRICT, WITHOUT ROWID;

CREATE TABLE rounds (
    tournament_id TEXT    NOT NULL REFERENCES tournaments (id),
    number        INTEGER NOT NULL CHECK (number > 0),
    started_at    INTEGER NOT NULL,
    -- when the last of its games had ended for the first time
    over_at       INTEGER,
    groups        TEXT    NOT NULL,  -- JSON: lists of team ids
    byes          TEXT    NOT NULL,  -- JSON: pairs of a matchday and a team id
    PRIMARY KEY (tournament_id, number)
) STRICT, WITHOUT ROWID;

-- What each team plays a round with, fixed at its start.
CREATE TABLE round_submissions (
    tournament_id TEXT    NOT NULL,
    round         INTEGER NOT NULL,
    team_id       TEXT    NOT NULL REFERENCES teams (id),
    submission_id TEXT    NOT NULL REFERENCES submissions (id),
    PRIMARY KEY (tournament_id, round, team_id),
    FOREIGN KEY (tournament_id, round) REFERENCES rounds (tournament_id, number)
) STRICT, WITHOUT ROWID;

CREATE INDEX round_submissions_of_submission ON round_submissions (submission_id);

CREATE TABLE games (
    game_no            INTEGER NOT NULL PRIMARY KEY,
    id                 TEXT    NOT NULL UNIQUE,
    tournament_id      TEXT    NOT NULL REFERENCES tournaments (id),
    purpose            TEXT    NOT NULL CHECK (purpose IN ('round', 'test', 'friendly', 'replay')),
    -- the place in the schedule
    round              INTEGER CHECK ((round IS NOT NULL) = (purpose IN ('round', 'replay'))),
    matchday           INTEGER CHECK ((matchday IS NULL) = (round IS NULL)),
    meeting            INTEGER CHECK ((meeting IS NULL) = (round IS NULL)),
    second_half        INTEGER CHECK ((second_half IS NULL) = (round IS NULL) AND second_half IN (0, 1)),
    -- which time the schedule is played again
    replay             INTEGER CHECK ((replay IS NOT NULL) = (purpose = 'replay')),
    -- of a test without: an organiser
    asked_by           TEXT    REFERENCES teams (id) CHECK (asked_by IS NULL OR purpose IN ('test', 'friendly')),
    home_team_id       TEXT    NOT NULL REFERENCES teams (id),
    away_team_id       TEXT    NOT NULL REFERENCES teams (id),
    home_submission_id TEXT    NOT NULL REFERENCES submissions (id),
    away_submission_id TEXT    NOT NULL REFERENCES submissions (id),
    seed               TEXT    NOT NULL,
    created_at         INTEGER NOT NULL,
    -- what plays it, or played it last; nothing of that is in the public archive
    unit_id            TEXT    UNIQUE REFERENCES units (id)
                           CHECK (unit_id IS NOT NULL OR state NOT IN ('queued', 'running')),
    state              TEXT    NOT NULL CHECK (state IN ('queued', 'running', 'played', 'broken', 'void', 'cancelled')),
    -- the attempt that plays it, or whose result counts
    attempt            INTEGER CHECK ((attempt IS NOT NULL) = (state IN ('running', 'played'))),
    ended_at           INTEGER CHECK ((ended_at IS NULL) = (state IN ('queued', 'running'))),
    reason             TEXT    CHECK ((reason IS NOT NULL) = (state IN ('broken', 'void', 'cancelled'))),
    FOREIGN KEY (id, attempt) REFERENCES game_attempts (game_id, number)
) STRICT;

-- Nothing of a schedule is played twice.
CREATE UNIQUE INDEX one_game_per_place ON games (tournament_id, COALESCE(replay, 0), round, meeting, second_half)
    WHERE round IS NOT NULL;
CREATE INDEX games_of_asker ON games (asked_by, created_at) WHERE asked_by IS NOT NULL;
CREATE INDEX games_of_home ON games (home_submission_id);
CREATE INDEX games_of_away ON games (away_submission_id);

-- Every time that a slot began a game, whatever came of it. What it played counts only where its game says so.
CREATE TABLE game_attempts (
    game_id     TEXT    NOT NULL REFERENCES games (id),
    number      INTEGER NOT NULL CHECK (number > 0),
    worker      TEXT    NOT NULL,
    begun_at    INTEGER NOT NULL,
    ended_at    INTEGER,
    outcome     TEXT    CHECK ((outcome IS NULL) = (ended_at IS NULL)
                    AND outcome IN ('played', 'broken', 'given_back', 'lost', 'called_off')),
    reason      TEXT    CHECK (reason IS NULL OR outcome IS NOT NULL),
    score       TEXT    CHECK ((score IS NOT NULL) = (outcome IS 'played')),  -- JSON; the scoring's
    -- artifact key prefix of its files, with their BLAKE3
    recording   TEXT    CHECK (recording IS NULL OR outcome IS 'played'),
    game_blake3 TEXT    CHECK ((game_blake3 IS NULL) = (recording IS NULL)),
    home_blake3 TEXT    CHECK ((home_blake3 IS NULL) = (recording IS NULL)),
    away_blake3 TEXT    CHECK ((away_blake3 IS NULL) = (recording IS NULL)),
    home_log    TEXT    CHECK ((home_log IS NULL) = (score IS NULL)),
    away_log    TEXT    CHECK ((away_log IS NULL) = (score IS NULL)),
    PRIMARY KEY (game_id, number)
) STRICT, WITHOUT ROWID;

CREATE UNIQUE INDEX one_attempt_at_a_time ON game_attempts (game_id) WHERE ended_at IS NULL;

-- The teams that play no friendly games which others ask for.
CREATE TABLE friendly_games_declined (
    team_id TEXT NOT NULL PRIMARY KEY REFERENCES teams (id)
) STRICT, WITHOUT ROWID;
