-- What boards and comparisons need of an evaluation's episodes, made once from its shards' outcomes.
-- Derived data: it may be removed at any time, and one of another version is made again.
CREATE TABLE episode_summaries (
    evaluation_id TEXT    NOT NULL PRIMARY KEY REFERENCES evaluations (id),
    version       INTEGER NOT NULL,
    summary       TEXT    NOT NULL  -- JSON; the scoring's
) STRICT;
