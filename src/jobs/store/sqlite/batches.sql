-- Batches, small results inside the database, and what is needed to work on small jobs in groups.
CREATE TABLE batches (
    id         TEXT    NOT NULL PRIMARY KEY,
    created_at INTEGER NOT NULL,
    count      INTEGER NOT NULL,           -- jobs
    rejected   INTEGER NOT NULL,           -- faulty cases that were left out
    complete   INTEGER NOT NULL DEFAULT 0  -- 0: still being filled, and not acknowledged
) STRICT, WITHOUT ROWID;

-- A key lives as long as its batch.
CREATE TABLE batch_keys (
    key      TEXT NOT NULL PRIMARY KEY,
    digest   BLOB NOT NULL,
    batch_id TEXT NOT NULL REFERENCES batches (id) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;
CREATE INDEX batch_keys_by_batch ON batch_keys (batch_id);

ALTER TABLE jobs ADD COLUMN batch_id TEXT REFERENCES batches (id) ON DELETE CASCADE;
ALTER TABLE jobs ADD COLUMN batch_index INTEGER;                         -- place of the case in what was sent, from 0
ALTER TABLE jobs ADD COLUMN group_size INTEGER NOT NULL DEFAULT 1;       -- jobs claimed together with this one
ALTER TABLE jobs ADD COLUMN alone INTEGER NOT NULL DEFAULT 0;            -- 1: its group died, it is claimed alone
ALTER TABLE jobs ADD COLUMN cost_us INTEGER NOT NULL DEFAULT 2147483647; -- expected solve time in µs
ALTER TABLE jobs ADD COLUMN outputs TEXT;                                -- JSON list; NULL: see the case
-- Ids within a batch grow with the place in it. The state is there for counting.
CREATE INDEX jobs_by_batch ON jobs (batch_id, id, state) WHERE batch_id IS NOT NULL;

-- Small results; jobs.result_key of others is their folder.
CREATE TABLE results (
    job_id   TEXT NOT NULL PRIMARY KEY REFERENCES jobs (id) ON DELETE CASCADE,
    solution BLOB NOT NULL,
    fields   BLOB
) STRICT;
