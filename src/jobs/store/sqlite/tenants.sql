-- Every job and batch belongs to a tenant; keys are how a tenant proves who it is.
CREATE TABLE api_keys (
    id         TEXT    NOT NULL PRIMARY KEY,
    hash       BLOB    NOT NULL,             -- BLAKE3 of the whole key, which is kept nowhere
    tenant     TEXT    NOT NULL,
    name       TEXT,
    created_at INTEGER NOT NULL,
    revoked_at INTEGER
) STRICT, WITHOUT ROWID;

ALTER TABLE jobs ADD COLUMN tenant TEXT NOT NULL DEFAULT 'anonymous';
ALTER TABLE batches ADD COLUMN tenant TEXT NOT NULL DEFAULT 'anonymous';

-- Lists of a tenant, the claim (oldest queued of the tenant whose turn it is) and the reaper (running).
DROP INDEX jobs_by_state;
CREATE INDEX jobs_by_state ON jobs (state, tenant, id);
CREATE INDEX jobs_by_tenant ON jobs (tenant, id);

CREATE TABLE labels_of_tenants (
    of_tenant TEXT NOT NULL,
    key       TEXT NOT NULL,
    value     TEXT NOT NULL,
    job_id    TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    PRIMARY KEY (of_tenant, key, value, job_id)
) STRICT, WITHOUT ROWID;
INSERT INTO labels_of_tenants SELECT 'anonymous', key, value, job_id FROM job_labels;
DROP TABLE job_labels;
ALTER TABLE labels_of_tenants RENAME TO job_labels;
CREATE INDEX job_labels_by_job ON job_labels (job_id);

CREATE TABLE keys_of_tenants (
    of_tenant TEXT NOT NULL,
    key       TEXT NOT NULL,
    digest    BLOB NOT NULL,
    job_id    TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    PRIMARY KEY (of_tenant, key)
) STRICT, WITHOUT ROWID;
INSERT INTO keys_of_tenants SELECT 'anonymous', key, digest, job_id FROM idempotency_keys;
DROP TABLE idempotency_keys;
ALTER TABLE keys_of_tenants RENAME TO idempotency_keys;
CREATE INDEX idempotency_keys_by_job ON idempotency_keys (job_id);

CREATE TABLE batch_keys_of_tenants (
    of_tenant TEXT NOT NULL,
    key       TEXT NOT NULL,
    digest    BLOB NOT NULL,
    batch_id  TEXT NOT NULL REFERENCES batches (id) ON DELETE CASCADE,
    PRIMARY KEY (of_tenant, key)
) STRICT, WITHOUT ROWID;
INSERT INTO batch_keys_of_tenants SELECT 'anonymous', key, digest, batch_id FROM batch_keys;
DROP TABLE batch_keys;
ALTER TABLE batch_keys_of_tenants RENAME TO batch_keys;
CREATE INDEX batch_keys_by_batch ON batch_keys (batch_id);
