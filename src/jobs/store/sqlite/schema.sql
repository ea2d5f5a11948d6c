-- The job table and what hangs on it. Times are epoch milliseconds, ids UUIDv7 in text form (they sort by time).
CREATE TABLE jobs (
    id               TEXT    NOT NULL PRIMARY KEY,
    tenant           TEXT    NOT NULL,
    state            TEXT    NOT NULL CHECK (state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled')),
    name             TEXT,
    labels           TEXT    NOT NULL,           -- JSON object, as shown to clients; job_labels is for finding
    method           TEXT    NOT NULL,
    outputs          TEXT    NOT NULL,           -- JSON list of the outputs asked for
    cost_us          INTEGER NOT NULL,           -- expected solve time of what is still to be solved, in µs
    slice_us         INTEGER NOT NULL,           -- that of its longest slice
    slices           INTEGER NOT NULL DEFAULT 0, -- slices that are solved and stored
    done             REAL    NOT NULL DEFAULT 0, -- the part of the job that they are, 0 to 1
    cache_key        BLOB,                       -- equal for cases that have the same answer; NULL: never a source
    bypass_cache            INTEGER NOT NULL,           -- 1: solved even if an identical case was solved before
    rank             INTEGER NOT NULL,           -- 0: high priority, 1: normal, 2: low
    deadline         INTEGER,                    -- a job that has not ended by then fails
    traceparent      TEXT,                       -- W3C trace context of the span that submitted it; NULL: nobody collects it
    batch_id         TEXT REFERENCES batches (id) ON DELETE CASCADE,
    batch_index      INTEGER,                    -- place of the case in what was sent, from 0
    created_at       INTEGER NOT NULL,
    updated_at       INTEGER NOT NULL,           -- of the last change, progress aside
    started_at       INTEGER,
    ended_at         INTEGER,
    attempt          INTEGER NOT NULL DEFAULT 0, -- attempts that count against the limit
    lease_token      INTEGER,                    -- of the last claim: the fence, random
    lease_until      INTEGER,                    -- by the clock of the process that runs the job
    worker           TEXT,
    group_size       INTEGER NOT NULL DEFAULT 1, -- jobs claimed together with this one
    suspect          INTEGER NOT NULL DEFAULT 0, -- 1: it ran together with others when their process died, it is solved alone
    solving          INTEGER NOT NULL DEFAULT 0, -- 1: running, and not waiting for its turn
    cancel_requested INTEGER NOT NULL DEFAULT 0,
    progress         REAL    NOT NULL DEFAULT 0,
    remarks          TEXT    NOT NULL DEFAULT '[]',
    failure          TEXT,
    blob_id          INTEGER REFERENCES blobs (id), -- the result; several jobs may refer to one
    field_patches    INTEGER NOT NULL DEFAULT 0, -- patches with stored fields; 0: there are none
    cached           INTEGER NOT NULL DEFAULT 0, -- 1: the result was computed for another job
    version          INTEGER NOT NULL DEFAULT 1
) STRICT, WITHOUT ROWID;

-- Lists of a tenant, the next tenant with queued jobs, and the reaper (running).
CREATE INDEX jobs_by_state ON jobs (state, tenant, id);
CREATE INDEX jobs_by_tenant ON jobs (tenant, id);
-- What changed last, for those who follow all that is a tenant's.
CREATE INDEX jobs_by_change ON jobs (tenant, updated_at, id, batch_id);
-- The claim: the next job of the tenant whose turn it is. Jobs leave it when they are claimed.
CREATE INDEX jobs_queued ON jobs (tenant, rank, id, cost_us) WHERE state = 'queued';
-- Those that are solved in part.
CREATE INDEX jobs_begun ON jobs (tenant, rank, id) WHERE state = 'queued' AND slices > 0;
CREATE INDEX jobs_by_deadline ON jobs (deadline) WHERE deadline IS NOT NULL AND ended_at IS NULL;
-- Ids within a batch grow with the place in it. The second is for counting and for lists by state.
CREATE INDEX jobs_by_batch ON jobs (batch_id, id) WHERE batch_id IS NOT NULL;
CREATE INDEX jobs_by_batch_and_state ON jobs (batch_id, state, id) WHERE batch_id IS NOT NULL;
-- Those of a batch that can still be cancelled.
CREATE INDEX jobs_to_cancel ON jobs (batch_id) WHERE ended_at IS NULL AND cancel_requested = 0;
CREATE INDEX jobs_by_cache_key ON jobs (cache_key) WHERE state = 'succeeded';
-- Who still refers to a blob.
CREATE INDEX jobs_by_blob ON jobs (blob_id) WHERE blob_id IS NOT NULL;

CREATE TABLE cases (
    job_id TEXT    NOT NULL PRIMARY KEY REFERENCES jobs (id) ON DELETE CASCADE,
    row    INTEGER NOT NULL, -- 1: the body is what the row puts into the template of its batch
    body   BLOB    NOT NULL
) STRICT;

-- How many jobs a tenant has in each state, kept by the database itself in the transaction of every change.
CREATE TABLE job_counts (
    state  TEXT    NOT NULL,
    tenant TEXT    NOT NULL,
    number INTEGER NOT NULL,
    PRIMARY KEY (state, tenant)
) STRICT, WITHOUT ROWID;
CREATE TRIGGER job_comes AFTER INSERT ON jobs BEGIN
    INSERT INTO job_counts (state, tenant, number) VALUES (NEW.state, NEW.tenant, 1)
        ON CONFLICT (state, tenant) DO UPDATE SET number = number + 1;
END;
CREATE TRIGGER job_goes AFTER DELETE ON jobs BEGIN
    UPDATE job_counts SET number = number - 1 WHERE state = OLD.state AND tenant = OLD.tenant;
END;
CREATE TRIGGER job_moves AFTER UPDATE OF state ON jobs WHEN OLD.state <> NEW.state BEGIN
    UPDATE job_counts SET number = number - 1 WHERE state = OLD.state AND tenant = OLD.tenant;
    INSERT INTO job_counts (state, tenant, number) VALUES (NEW.state, NEW.tenant, 1)
        ON CONFLICT (state, tenant) DO UPDATE SET number = number + 1;
END;

CREATE TABLE job_labels (
    of_tenant TEXT NOT NULL,
    key       TEXT NOT NULL,
    value     TEXT NOT NULL,
    job_id    TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    state     TEXT NOT NULL, -- of the job
    PRIMARY KEY (of_tenant, key, value, job_id)
) STRICT, WITHOUT ROWID;
CREATE INDEX job_labels_by_job ON job_labels (job_id);
CREATE INDEX job_labels_by_state ON job_labels (of_tenant, key, value, state, job_id);
CREATE TRIGGER job_moves_with_labels AFTER UPDATE OF state ON jobs WHEN OLD.state <> NEW.state AND NEW.labels <> '{}' BEGIN
    UPDATE job_labels SET state = NEW.state WHERE job_id = NEW.id;
END;

-- Results. A small one lies here, a large one in the folder of results under its key. A blob that nothing refers to is
-- removed in the transaction that drops the last reference; the key of a large one is then left to the collector.
CREATE TABLE blobs (
    id       INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT,
    key      TEXT,             -- of a large result
    bytes    INTEGER NOT NULL, -- solution and fields
    solution BLOB,             -- of a small result
    fields   BLOB
) STRICT;
CREATE INDEX blobs_by_key ON blobs (key, bytes) WHERE key IS NOT NULL;

-- Keys of large results that nobody refers to and that are still to be removed.
CREATE TABLE blob_outbox (
    key TEXT NOT NULL PRIMARY KEY
) STRICT, WITHOUT ROWID;

-- Solved slices of jobs that are not solved whole. They refer to blobs as jobs do, and go in the transaction in which their
-- job ends, whatever ends it.
CREATE TABLE job_slices (
    job_id   TEXT    NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    number   INTEGER NOT NULL, -- among the slices of the case, from 0
    motions  INTEGER NOT NULL, -- motions of the case up to the end of the slice
    digest   TEXT    NOT NULL, -- of the case, as the solver that solved the slice knew it
    spent_us INTEGER NOT NULL, -- solver time of the job up to the end of the slice
    blob_id  INTEGER NOT NULL REFERENCES blobs (id),
    PRIMARY KEY (job_id, number)
) STRICT, WITHOUT ROWID;
CREATE INDEX job_slices_by_blob ON job_slices (blob_id);

CREATE TABLE batches (
    id         TEXT    NOT NULL PRIMARY KEY,
    tenant     TEXT    NOT NULL,
    created_at INTEGER NOT NULL,
    count      INTEGER NOT NULL DEFAULT 0, -- jobs
    rejected   INTEGER NOT NULL DEFAULT 0, -- faulty cases that were left out
    reserved   INTEGER NOT NULL DEFAULT 0, -- places in the queue that are kept for jobs still to come
    complete   INTEGER NOT NULL DEFAULT 0, -- 0: still being staged or filled, and not acknowledged
    dropped    INTEGER NOT NULL DEFAULT 0, -- 1: given up, and being removed
    name       TEXT,
    labels     TEXT    NOT NULL DEFAULT '{}', -- JSON object
    ended_at   INTEGER                     -- when the last of its jobs that have ended did so
) STRICT, WITHOUT ROWID;
CREATE INDEX batches_by_tenant ON batches (tenant, id) WHERE complete = 1;
CREATE TRIGGER job_of_batch_ends AFTER UPDATE OF ended_at ON jobs WHEN NEW.ended_at IS NOT NULL AND NEW.batch_id IS NOT NULL BEGIN
    UPDATE batches SET ended_at = NEW.ended_at WHERE id = NEW.batch_id;
END;
CREATE INDEX batches_incomplete ON batches (tenant, id, reserved) WHERE complete = 0;

-- The case that the rows of a table fill.
CREATE TABLE batch_templates (
    batch_id TEXT NOT NULL PRIMARY KEY REFERENCES batches (id) ON DELETE CASCADE,
    body     BLOB NOT NULL
) STRICT;

-- A key lives as long as its batch.
CREATE TABLE batch_keys (
    of_tenant TEXT NOT NULL,
    key       TEXT NOT NULL,
    digest    BLOB NOT NULL,
    batch_id  TEXT NOT NULL REFERENCES batches (id) ON DELETE CASCADE,
    PRIMARY KEY (of_tenant, key)
) STRICT, WITHOUT ROWID;
CREATE INDEX batch_keys_by_batch ON batch_keys (batch_id);

-- A key lives as long as its job.
CREATE TABLE idempotency_keys (
    of_tenant TEXT NOT NULL,
    key       TEXT NOT NULL,
    digest    BLOB NOT NULL,
    job_id    TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    PRIMARY KEY (of_tenant, key)
) STRICT, WITHOUT ROWID;
CREATE INDEX idempotency_keys_by_job ON idempotency_keys (job_id);

-- Cross-sections that cases name by their digest.
CREATE TABLE profiles (
    tenant     TEXT    NOT NULL,
    digest     TEXT    NOT NULL,
    body       BLOB    NOT NULL,
    bytes      INTEGER NOT NULL,
    created_at INTEGER NOT NULL,
    PRIMARY KEY (tenant, digest)
) STRICT, WITHOUT ROWID;

-- Ids of jobs and batches that have expired.
CREATE TABLE tombstones (
    id      TEXT    NOT NULL PRIMARY KEY,
    tenant  TEXT    NOT NULL,
    gone_at INTEGER NOT NULL
) STRICT, WITHOUT ROWID;

-- Keys are how a tenant proves who it is.
CREATE TABLE api_keys (
    id         TEXT    NOT NULL PRIMARY KEY,
    hash       BLOB    NOT NULL,             -- BLAKE3 of the whole key, which is kept nowhere
    tenant     TEXT    NOT NULL,
    name       TEXT,
    created_at INTEGER NOT NULL,
    revoked_at INTEGER,
    read_only  INTEGER NOT NULL DEFAULT 0,   -- 1: it changes nothing
    labels     TEXT    NOT NULL DEFAULT '{}' -- it opens only what carries these
) STRICT, WITHOUT ROWID;
