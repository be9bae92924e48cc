-- Who may do what: people with one role each, the links by which they join, and the keys by which people, teams
-- and the host call.

-- What taking part means; the newest version is what people accept.
CREATE TABLE terms (
    version INTEGER NOT NULL PRIMARY KEY CHECK (version > 0),
    since   INTEGER NOT NULL,
    text    TEXT    NOT NULL
) STRICT;

CREATE TABLE divisions (
    name     TEXT    NOT NULL PRIMARY KEY COLLATE NOCASE,
    position INTEGER NOT NULL
) STRICT, WITHOUT ROWID;

-- A team's key moves to a table of its own. Teams are referred to by much, so that they are made anew in their
-- place: until the transaction ends the references may hang.
PRAGMA defer_foreign_keys = ON;

CREATE TEMPORARY TABLE old_teams AS SELECT * FROM teams;
DROP TABLE teams;

CREATE TABLE teams (
    id               TEXT    NOT NULL PRIMARY KEY,
    -- "alpha" and "Alpha" on one board would be taken for each other
    name             TEXT    NOT NULL UNIQUE COLLATE NOCASE,
    created_at       INTEGER NOT NULL,
    disqualified_at  INTEGER,
    disqualified_for TEXT    CHECK ((disqualified_for IS NULL) = (disqualified_at IS NULL)),
    affiliation      TEXT,
    link             TEXT,
    division         TEXT    REFERENCES divisions (name),
    -- from then on it neither uploads nor plays, by its own wish
    retired_at       INTEGER
) STRICT;

INSERT INTO teams (id, name, created_at, disqualified_at, disqualified_for)
SELECT id, name, created_at, disqualified_at, disqualified_for FROM old_teams;

CREATE TABLE people (
    id             TEXT    NOT NULL PRIMARY KEY,
    -- by which they sign in
    name           TEXT    NOT NULL UNIQUE COLLATE NOCASE,
    -- the one whose member it is; NULL: an organiser
    team_id        TEXT    REFERENCES teams (id),
    joined_at      INTEGER NOT NULL,
    -- from then on they may do nothing; their name stays with what they did
    left_at        INTEGER,
    password       TEXT,    -- PHC string of an Argon2id hash; NULL: by keys and links only
    accepted_terms INTEGER REFERENCES terms (version)
) STRICT;

CREATE INDEX people_of_team ON people (team_id);

CREATE TABLE tokens (
    id           TEXT    NOT NULL PRIMARY KEY,
    hash         BLOB    NOT NULL UNIQUE CHECK (length(hash) = 32),
    -- a session is sent by a browser as a cookie, and is made by signing in
    kind         TEXT    NOT NULL CHECK (kind IN ('key', 'session')),
    owner        TEXT    NOT NULL CHECK (owner IN ('host', 'team', 'person')),
    team_id      TEXT    REFERENCES teams (id) CHECK ((team_id IS NOT NULL) = (owner = 'team')),
    person_id    TEXT    REFERENCES people (id) CHECK ((person_id IS NOT NULL) = (owner = 'person')),
    name         TEXT    NOT NULL,
    created_at   INTEGER NOT NULL,
    expires_at   INTEGER CHECK (expires_at IS NOT NULL OR kind = 'key'),
    -- to the minute
    last_used_at INTEGER,
    revoked_at   INTEGER
) STRICT;

CREATE INDEX tokens_of_team ON tokens (team_id) WHERE team_id IS NOT NULL;
CREATE INDEX tokens_of_person ON tokens (person_id) WHERE person_id IS NOT NULL;

INSERT INTO tokens (id, hash, kind, owner, team_id, name, created_at)
SELECT lower(hex(randomblob(4)) || '-' || hex(randomblob(2)) || '-4' || substr(hex(randomblob(2)), 2) || '-a'
             || substr(hex(randomblob(2)), 2) || '-' || hex(randomblob(6))),
       token_hash, 'key', 'team', id, 'first', created_at
FROM old_teams;
DROP TABLE old_teams;

-- A link is good for one person, once, for a time.
CREATE TABLE invitations (
    id          TEXT    NOT NULL PRIMARY KEY,
    code_hash   BLOB    NOT NULL UNIQUE CHECK (length(code_hash) = 32),
    -- to be an organiser; a member of the team; the founder of a team; or to come back as the person
    role        TEXT    NOT NULL CHECK (role IN ('organiser', 'member', 'founder', 'return')),
    team_id     TEXT    REFERENCES teams (id) CHECK ((team_id IS NOT NULL) = (role = 'member')),
    person_id   TEXT    REFERENCES people (id) CHECK ((person_id IS NOT NULL) = (role = 'return')),
    note        TEXT    NOT NULL,  -- for whom
    created_at  INTEGER NOT NULL,
    expires_at  INTEGER NOT NULL,
    accepted_at INTEGER,
    accepted_by TEXT    REFERENCES people (id) CHECK ((accepted_by IS NULL) = (accepted_at IS NULL)),
    revoked_at  INTEGER CHECK (revoked_at IS NULL OR accepted_at IS NULL)
) STRICT;

-- A team that wants to take part. Approved, its code is a member's invitation.
CREATE TABLE registrations (
    id             TEXT    NOT NULL PRIMARY KEY,
    code_hash      BLOB    NOT NULL UNIQUE CHECK (length(code_hash) = 32),
    team_name      TEXT    NOT NULL,
    affiliation    TEXT,
    link           TEXT,
    division       TEXT,
    contact        TEXT    NOT NULL,
    accepted_terms INTEGER REFERENCES terms (version),
    created_at     INTEGER NOT NULL,
    state          TEXT    NOT NULL CHECK (state IN ('waiting', 'approved', 'refused')),
    decided_at     INTEGER CHECK ((decided_at IS NULL) = (state = 'waiting')),
    reason         TEXT    CHECK ((reason IS NOT NULL) = (state = 'refused')),
    team_id        TEXT    REFERENCES teams (id) CHECK ((team_id IS NOT NULL) = (state = 'approved'))
) STRICT;

CREATE INDEX registrations_waiting ON registrations (created_at) WHERE state = 'waiting';

-- May anybody register a team?
ALTER TABLE season ADD COLUMN takes_registrations INTEGER NOT NULL DEFAULT 0 CHECK (takes_registrations IN (0, 1));
