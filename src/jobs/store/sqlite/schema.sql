-- The job table and what hangs on it. Times are epoch milliseconds, ids UUIDv7 in text form (they sort by time).
CREATE TABLE jobs (
    id               TEXT    NOT NULL PRIMARY KEY,
    state            TEXT    NOT NULL CHECK (state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled')),
    name             TEXT,
    labels           TEXT    NOT NULL,           -- JSON object, as shown to clients; job_labels is for finding
    method           TEXT    NOT NULL,
    created_at       INTEGER NOT NULL,
    started_at       INTEGER,
    ended_at         INTEGER,
    attempt          INTEGER NOT NULL DEFAULT 0, -- attempts that count against the limit
    lease_number     INTEGER NOT NULL DEFAULT 0, -- claims ever made: the fencing token, never lowered
    lease_until      INTEGER,
    worker           TEXT,
    cancel_requested INTEGER NOT NULL DEFAULT 0,
    progress         REAL    NOT NULL DEFAULT 0,
    warnings         TEXT    NOT NULL DEFAULT '[]',
    failure          TEXT,
    result_key       TEXT,                       -- folder of the stored result
    field_patches    INTEGER NOT NULL DEFAULT 0, -- patches with stored fields; 0: there is no fields object
    version          INTEGER NOT NULL DEFAULT 1
) STRICT, WITHOUT ROWID;

-- Lists by state, the claim (oldest queued) and the reaper (running). Lists without state use the primary key.
CREATE INDEX jobs_by_state ON jobs (state, id);

CREATE TABLE cases (
    job_id TEXT NOT NULL PRIMARY KEY REFERENCES jobs (id) ON DELETE CASCADE,
    body   BLOB NOT NULL
) STRICT;

CREATE TABLE job_labels (
    key    TEXT NOT NULL,
    value  TEXT NOT NULL,
    job_id TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    PRIMARY KEY (key, value, job_id)
) STRICT, WITHOUT ROWID;
CREATE INDEX job_labels_by_job ON job_labels (job_id);

-- A key lives as long as its job.
CREATE TABLE idempotency_keys (
    key    TEXT NOT NULL PRIMARY KEY,
    digest BLOB NOT NULL,
    job_id TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;
CREATE INDEX idempotency_keys_by_job ON idempotency_keys (job_id);
