-- Which versions of the program have opened this database, in order: an upgrade says from which to which, and a
-- program that is too old says which one it takes.
CREATE TABLE programs (
    id      INTEGER NOT NULL PRIMARY KEY,
    version TEXT    NOT NULL UNIQUE,
    -- the newest migration that it knew
    schema  INTEGER NOT NULL
) STRICT;
