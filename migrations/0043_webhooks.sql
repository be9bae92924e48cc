-- Addresses of programs that are told of what happens, and what each is told.
CREATE TABLE webhooks (
    id               TEXT    NOT NULL PRIMARY KEY,
    -- whose; none: the organisers'
    team_id          TEXT    REFERENCES teams (id),
    name             TEXT    NOT NULL,
    url              TEXT    NOT NULL,
    -- what it is told of, a JSON array; empty: everything that its owner may know
    about            TEXT    NOT NULL,
    -- the key of its signatures: it is needed as it is
    secret           BLOB    NOT NULL CHECK (length(secret) = 32),
    old_secret       BLOB    CHECK (length(old_secret) = 32),
    -- until then the old one signs, too
    old_secret_until INTEGER CHECK ((old_secret_until IS NOT NULL) = (old_secret IS NOT NULL)),
    created_at       INTEGER NOT NULL,
    -- the event until which all has become deliveries
    seen             INTEGER NOT NULL,
    -- since the last delivery that was taken
    failing_since    INTEGER,
    -- nothing is sent any more
    dead_at          INTEGER,
    dead_for         TEXT    CHECK ((dead_for IS NOT NULL) = (dead_at IS NOT NULL))
) STRICT;

CREATE INDEX webhooks_of_team ON webhooks (team_id);

CREATE TABLE webhook_deliveries (
    -- as the receiver reads it, however often it is sent
    id          TEXT    NOT NULL PRIMARY KEY,
    webhook_id  TEXT    NOT NULL REFERENCES webhooks (id) ON DELETE CASCADE,
    -- none: a test
    event_id    INTEGER,
    kind        TEXT    NOT NULL,
    body        TEXT    NOT NULL,
    created_at  INTEGER NOT NULL,
    attempts    INTEGER NOT NULL,
    -- when it is sent next, while it waits
    next_at     INTEGER CHECK ((next_at IS NOT NULL) = (state = 'waiting')),
    state       TEXT    NOT NULL CHECK (state IN ('waiting', 'delivered', 'given_up')),
    settled_at  INTEGER CHECK ((settled_at IS NOT NULL) = (state <> 'waiting')),
    -- what came of the last attempt
    last_at     INTEGER,
    last_status INTEGER,
    last_error  TEXT,
    UNIQUE (webhook_id, event_id)
) STRICT;

CREATE INDEX webhook_deliveries_due ON webhook_deliveries (next_at) WHERE state = 'waiting';
CREATE INDEX webhook_deliveries_waiting ON webhook_deliveries (webhook_id) WHERE state = 'waiting';
CREATE INDEX webhook_deliveries_of_hook ON webhook_deliveries (webhook_id, created_at);
CREATE INDEX webhook_deliveries_settled ON webhook_deliveries (settled_at) WHERE state <> 'waiting';
