-- Workers on other machines of which nothing is taken, by the names that they go by, until an organiser readmits them.
CREATE TABLE worker_bans (
    worker    TEXT    NOT NULL PRIMARY KEY,
    banned_at INTEGER NOT NULL,
    reason    TEXT    NOT NULL
) STRICT, WITHOUT ROWID;

-- What they have played, by the names of their slots: `remote/WORKER/SLOT`.
CREATE INDEX units_played_elsewhere ON units (worker)
    WHERE state = 'done' AND worker >= 'remote/' AND worker < 'remote0';
