-- The job table and what hangs on it, as in the embedded table. Times are epoch milliseconds, ids UUIDv7 in text form (they
-- sort by time), flags 0 or 1. Texts that are compared sort by their bytes, whatever the language of the database.
CREATE TABLE deployment (
    one         bigint NOT NULL PRIMARY KEY CHECK (one = 1),
    form        bigint NOT NULL,           -- version of this file
    touched     bigint NOT NULL DEFAULT 0  -- written to find out whether the database takes data
);

-- What runs here. A node that was not seen for a while is dead.
CREATE TABLE nodes (
    id       text   COLLATE "C" NOT NULL PRIMARY KEY,
    version  text   NOT NULL,
    workers  bigint NOT NULL,
    seen_at  bigint NOT NULL
);

CREATE TABLE batches (
    id           text   COLLATE "C" NOT NULL PRIMARY KEY,
    tenant       text   COLLATE "C" NOT NULL,
    created_at   bigint NOT NULL,
    count        bigint NOT NULL DEFAULT 0,
    rejected     bigint NOT NULL DEFAULT 0,
    reserved     bigint NOT NULL DEFAULT 0,
    complete     bigint NOT NULL DEFAULT 0,
    dropped      bigint NOT NULL DEFAULT 0,
    -- Whoever receives or fills it has shown a sign of life; afterwards it is given up, if it is not complete.
    filled_until bigint NOT NULL DEFAULT CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint) + 60000,
    name         text,
    labels       text   NOT NULL DEFAULT '{}',
    ended_at     bigint
) WITH (fillfactor = 70);
CREATE INDEX batches_by_tenant ON batches (tenant, id) WHERE complete = 1;
CREATE INDEX batches_incomplete ON batches (tenant, id) INCLUDE (reserved) WHERE complete = 0;

CREATE SEQUENCE blob_ids CACHE 1;
CREATE TABLE blobs (
    id       bigint NOT NULL PRIMARY KEY,
    key      text   COLLATE "C",
    bytes    bigint NOT NULL,
    solution bytea,
    fields   bytea
);
-- Fields are compressed already.
ALTER TABLE blobs ALTER fields SET STORAGE EXTERNAL;
CREATE INDEX blobs_by_key ON blobs (key, bytes) WHERE key IS NOT NULL;

CREATE TABLE jobs (
    id               text   COLLATE "C" NOT NULL PRIMARY KEY,
    tenant           text   COLLATE "C" NOT NULL,
    state            text   COLLATE "C" NOT NULL
        CHECK (state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled')),
    name             text,
    labels           text   NOT NULL,
    method           text   NOT NULL,
    outputs          text   NOT NULL,
    cost_us          bigint NOT NULL,
    slice_us         bigint NOT NULL,
    slices           bigint NOT NULL DEFAULT 0,
    done             double precision NOT NULL DEFAULT 0,
    cache_key        bytea,
    bypass_cache     bigint NOT NULL,
    rank             bigint NOT NULL,
    deadline         bigint,
    traceparent      text,
    batch_id         text   COLLATE "C" REFERENCES batches (id) ON DELETE CASCADE,
    batch_index      bigint,
    created_at       bigint NOT NULL,
    updated_at       bigint NOT NULL,
    started_at       bigint,
    ended_at         bigint,
    attempt          bigint NOT NULL DEFAULT 0,
    lease_token      bigint,
    lease_until      bigint, -- by the clock of the database
    worker           text,
    group_size       bigint NOT NULL DEFAULT 1,
    suspect          bigint NOT NULL DEFAULT 0,
    solving          bigint NOT NULL DEFAULT 0,
    cancel_requested bigint NOT NULL DEFAULT 0,
    progress         double precision NOT NULL DEFAULT 0,
    remarks          text   NOT NULL DEFAULT '[]',
    failure          text,
    blob_id          bigint REFERENCES blobs (id),
    field_patches    bigint NOT NULL DEFAULT 0,
    cached           bigint NOT NULL DEFAULT 0,
    version          bigint NOT NULL DEFAULT 1
) WITH (fillfactor = 70, autovacuum_vacuum_scale_factor = 0.02, autovacuum_vacuum_threshold = 5000,
        autovacuum_analyze_scale_factor = 0.05);
-- No index has `lease_until`, `progress` or `version`, so that heartbeats touch none.
CREATE INDEX jobs_by_state ON jobs (state, tenant, id);
CREATE INDEX jobs_by_tenant ON jobs (tenant, id);
CREATE INDEX jobs_by_change ON jobs (tenant, updated_at, id);
CREATE INDEX jobs_queued ON jobs (tenant, rank, id) WHERE state = 'queued';
CREATE INDEX jobs_begun ON jobs (tenant, rank, id) WHERE state = 'queued' AND slices > 0;
CREATE INDEX jobs_running ON jobs (id) WHERE state = 'running';
CREATE INDEX jobs_by_deadline ON jobs (deadline) WHERE deadline IS NOT NULL AND ended_at IS NULL;
CREATE INDEX jobs_by_batch ON jobs (batch_id, id) WHERE batch_id IS NOT NULL;
CREATE INDEX jobs_by_batch_and_state ON jobs (batch_id, state, id) WHERE batch_id IS NOT NULL;
CREATE INDEX jobs_to_cancel ON jobs (batch_id) WHERE ended_at IS NULL AND cancel_requested = 0;
CREATE INDEX jobs_by_cache_key ON jobs (cache_key) WHERE state = 'succeeded';
CREATE INDEX jobs_by_blob ON jobs (blob_id) WHERE blob_id IS NOT NULL;

CREATE TABLE cases (
    job_id text   COLLATE "C" NOT NULL PRIMARY KEY REFERENCES jobs (id) ON DELETE CASCADE,
    row    bigint NOT NULL,
    body   bytea  NOT NULL
);

CREATE TABLE job_labels (
    of_tenant text COLLATE "C" NOT NULL,
    key       text COLLATE "C" NOT NULL,
    value     text COLLATE "C" NOT NULL,
    job_id    text COLLATE "C" NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    state     text COLLATE "C" NOT NULL,
    PRIMARY KEY (of_tenant, key, value, job_id)
);
CREATE INDEX job_labels_by_job ON job_labels (job_id);
CREATE INDEX job_labels_by_state ON job_labels (of_tenant, key, value, state, job_id);

-- How many jobs a tenant has in each state: the sum of these rows. A change of jobs adds rows and waits for nobody; once in a
-- while they are added up.
CREATE TABLE job_counts (
    state  text   COLLATE "C" NOT NULL,
    tenant text   COLLATE "C" NOT NULL,
    number bigint NOT NULL
) WITH (autovacuum_vacuum_scale_factor = 0.1, autovacuum_vacuum_threshold = 1000, autovacuum_vacuum_cost_delay = 0);
CREATE INDEX job_counts_by_state ON job_counts (state, tenant) INCLUDE (number);

CREATE FUNCTION jobs_came() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO job_counts (state, tenant, number) SELECT state, tenant, COUNT(*) FROM came GROUP BY state, tenant;
    RETURN NULL;
END $$;
CREATE TRIGGER jobs_come AFTER INSERT ON jobs REFERENCING NEW TABLE AS came
    FOR EACH STATEMENT EXECUTE FUNCTION jobs_came();

CREATE FUNCTION jobs_went() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO job_counts (state, tenant, number) SELECT state, tenant, -COUNT(*) FROM went GROUP BY state, tenant;
    RETURN NULL;
END $$;
CREATE TRIGGER jobs_go AFTER DELETE ON jobs REFERENCING OLD TABLE AS went
    FOR EACH STATEMENT EXECUTE FUNCTION jobs_went();

CREATE FUNCTION jobs_moved() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO job_counts (state, tenant, number)
        SELECT state, tenant, SUM(number) FROM
            (SELECT state, tenant, -1 AS number FROM before UNION ALL SELECT state, tenant, 1 FROM after) AS moves
        GROUP BY state, tenant HAVING SUM(number) <> 0;
    IF EXISTS (SELECT 1 FROM after JOIN before USING (id) WHERE after.state <> before.state AND after.labels <> '{}') THEN
        UPDATE job_labels SET state = after.state FROM after WHERE job_labels.job_id = after.id AND after.labels <> '{}';
    END IF;
    IF EXISTS (SELECT 1 FROM after WHERE ended_at IS NOT NULL AND batch_id IS NOT NULL) THEN
        -- Batches are locked in the order of their ids, so that two who end jobs of the same batches do not wait for each
        -- other.
        PERFORM 1 FROM batches WHERE id IN (SELECT batch_id FROM after WHERE ended_at IS NOT NULL) ORDER BY id FOR NO KEY UPDATE;
        UPDATE batches SET ended_at = GREATEST(batches.ended_at, last.ended_at) FROM
            (SELECT batch_id, MAX(ended_at) AS ended_at FROM after WHERE ended_at IS NOT NULL GROUP BY batch_id) AS last
        WHERE batches.id = last.batch_id;
    END IF;
    RETURN NULL;
END $$;
CREATE TRIGGER jobs_move AFTER UPDATE ON jobs REFERENCING OLD TABLE AS before NEW TABLE AS after
    FOR EACH STATEMENT EXECUTE FUNCTION jobs_moved();

-- Large results, in pieces of 1 MiB.
CREATE TABLE objects (
    path    text   COLLATE "C" NOT NULL,
    number  bigint NOT NULL, -- of the piece, from 0
    size    bigint NOT NULL, -- of the whole object
    body    bytea  NOT NULL,
    made_at bigint NOT NULL DEFAULT CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint),
    PRIMARY KEY (path, number)
);
ALTER TABLE objects ALTER body SET STORAGE EXTERNAL;

CREATE TABLE blob_outbox (
    key text COLLATE "C" NOT NULL PRIMARY KEY
);

CREATE TABLE job_slices (
    job_id   text   COLLATE "C" NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    number   bigint NOT NULL,
    motions  bigint NOT NULL,
    digest   text   NOT NULL,
    spent_us bigint NOT NULL,
    blob_id  bigint NOT NULL REFERENCES blobs (id),
    PRIMARY KEY (job_id, number)
);
CREATE INDEX job_slices_by_blob ON job_slices (blob_id);

CREATE TABLE batch_templates (
    batch_id text  COLLATE "C" NOT NULL PRIMARY KEY REFERENCES batches (id) ON DELETE CASCADE,
    body     bytea NOT NULL
);

CREATE TABLE batch_keys (
    of_tenant text  COLLATE "C" NOT NULL,
    key       text  COLLATE "C" NOT NULL,
    digest    bytea NOT NULL,
    batch_id  text  COLLATE "C" NOT NULL REFERENCES batches (id) ON DELETE CASCADE,
    PRIMARY KEY (of_tenant, key)
);
CREATE INDEX batch_keys_by_batch ON batch_keys (batch_id);

CREATE TABLE idempotency_keys (
    of_tenant text  COLLATE "C" NOT NULL,
    key       text  COLLATE "C" NOT NULL,
    digest    bytea NOT NULL,
    job_id    text  COLLATE "C" NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    PRIMARY KEY (of_tenant, key)
);
CREATE INDEX idempotency_keys_by_job ON idempotency_keys (job_id);

CREATE TABLE tombstones (
    id      text   COLLATE "C" NOT NULL PRIMARY KEY,
    tenant  text   COLLATE "C" NOT NULL,
    gone_at bigint NOT NULL
);

CREATE TABLE api_keys (
    id         text   COLLATE "C" NOT NULL PRIMARY KEY,
    hash       bytea  NOT NULL,
    tenant     text   COLLATE "C" NOT NULL,
    name       text,
    created_at bigint NOT NULL,
    revoked_at bigint,
    read_only  bigint NOT NULL DEFAULT 0
);
