-- Ids of jobs and batches that have expired.
CREATE TABLE tombstones (
    id      TEXT    NOT NULL PRIMARY KEY,
    tenant  TEXT    NOT NULL,
    gone_at INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
