-- Kinds of work. Runs belonged to a tenant of their own, '<tenant>/rows'; now they are batches of the kind 'rows', and their chunks jobs of it.
ALTER TABLE jobs ADD COLUMN kind TEXT NOT NULL DEFAULT 'case' CHECK (kind IN ('case', 'rows')); -- what the body is
ALTER TABLE batches ADD COLUMN kind TEXT NOT NULL DEFAULT 'cases' CHECK (kind IN ('cases', 'rows'));

DROP TRIGGER job_comes;
DROP TRIGGER job_goes;
DROP TRIGGER job_moves;
DROP TRIGGER case_comes;
DROP TRIGGER case_goes;
DROP TRIGGER template_comes;
DROP TRIGGER template_goes;
DROP INDEX jobs_by_state;
DROP INDEX jobs_by_tenant;
DROP INDEX jobs_by_change;
DROP INDEX jobs_queued;
DROP INDEX jobs_begun;
DROP INDEX batches_by_tenant;
DROP INDEX batches_incomplete;

UPDATE jobs SET kind = 'rows', tenant = replace(tenant, '/rows', '') WHERE tenant LIKE '%/rows';
-- A template that both have counts once.
UPDATE stored_bytes SET bytes = bytes - COALESCE((SELECT SUM(length(one.body)) FROM templates AS one
    JOIN templates AS other ON other.tenant = replace(one.tenant, '/rows', '') AND other.digest = one.digest
    WHERE one.tenant = stored_bytes.tenant || '/rows'), 0);
INSERT OR IGNORE INTO templates (tenant, digest, body)
    SELECT replace(tenant, '/rows', ''), digest, body FROM templates WHERE tenant LIKE '%/rows';
DELETE FROM templates WHERE tenant LIKE '%/rows';
UPDATE batches SET kind = 'rows', tenant = replace(tenant, '/rows', '') WHERE tenant LIKE '%/rows';
UPDATE tombstones SET tenant = replace(tenant, '/rows', '') WHERE tenant LIKE '%/rows';

-- A key may stand for a batch and for a run.
ALTER TABLE batch_keys RENAME TO old_batch_keys;
CREATE TABLE batch_keys (
    of_tenant TEXT NOT NULL,
    kind      TEXT NOT NULL, -- of the batch
    key       TEXT NOT NULL,
    digest    BLOB NOT NULL,
    batch_id  TEXT NOT NULL REFERENCES batches (id) ON DELETE CASCADE,
    PRIMARY KEY (of_tenant, kind, key)
) STRICT, WITHOUT ROWID;
INSERT INTO batch_keys (of_tenant, kind, key, digest, batch_id)
    SELECT replace(of_tenant, '/rows', ''), CASE WHEN of_tenant LIKE '%/rows' THEN 'rows' ELSE 'cases' END, key, digest, batch_id
    FROM old_batch_keys;
DROP TABLE old_batch_keys;
CREATE INDEX batch_keys_by_batch ON batch_keys (batch_id);

ALTER TABLE job_counts RENAME TO old_job_counts;
CREATE TABLE job_counts (
    state  TEXT    NOT NULL,
    tenant TEXT    NOT NULL,
    kind   TEXT    NOT NULL,
    number INTEGER NOT NULL,
    PRIMARY KEY (state, tenant, kind)
) STRICT, WITHOUT ROWID;
INSERT INTO job_counts (state, tenant, kind, number)
    SELECT state, replace(tenant, '/rows', ''), CASE WHEN tenant LIKE '%/rows' THEN 'rows' ELSE 'case' END, number FROM old_job_counts;
DROP TABLE old_job_counts;

CREATE INDEX jobs_by_state ON jobs (state, tenant, kind, id);
CREATE INDEX jobs_by_tenant ON jobs (tenant, kind, id);
CREATE INDEX jobs_by_change ON jobs (tenant, updated_at, id, batch_id, kind);
CREATE INDEX jobs_queued ON jobs (tenant, kind, rank, id, cost_us) WHERE state = 'queued';
CREATE INDEX jobs_begun ON jobs (tenant, kind, rank, id) WHERE state = 'queued' AND slices > 0;
CREATE INDEX batches_by_tenant ON batches (tenant, kind, id) WHERE complete = 1;
CREATE INDEX batches_incomplete ON batches (tenant, id, reserved) WHERE complete = 0;

CREATE TRIGGER job_comes AFTER INSERT ON jobs BEGIN
    INSERT INTO job_counts (state, tenant, kind, number) VALUES (NEW.state, NEW.tenant, NEW.kind, 1)
        ON CONFLICT (state, tenant, kind) DO UPDATE SET number = number + 1;
    INSERT INTO stored_bytes (tenant, bytes) VALUES (NEW.tenant, NEW.case_bytes)
        ON CONFLICT (tenant) DO UPDATE SET bytes = bytes + excluded.bytes;
END;
CREATE TRIGGER job_goes AFTER DELETE ON jobs BEGIN
    UPDATE job_counts SET number = number - 1 WHERE state = OLD.state AND tenant = OLD.tenant AND kind = OLD.kind;
    UPDATE stored_bytes SET bytes = bytes - OLD.case_bytes WHERE tenant = OLD.tenant;
END;
CREATE TRIGGER job_moves AFTER UPDATE OF state ON jobs WHEN OLD.state <> NEW.state BEGIN
    UPDATE job_counts SET number = number - 1 WHERE state = OLD.state AND tenant = OLD.tenant AND kind = OLD.kind;
    INSERT INTO job_counts (state, tenant, kind, number) VALUES (NEW.state, NEW.tenant, NEW.kind, 1)
        ON CONFLICT (state, tenant, kind) DO UPDATE SET number = number + 1;
END;
CREATE TRIGGER template_comes AFTER INSERT ON templates BEGIN
    INSERT INTO stored_bytes (tenant, bytes) VALUES (NEW.tenant, length(NEW.body))
        ON CONFLICT (tenant) DO UPDATE SET bytes = bytes + excluded.bytes;
END;
CREATE TRIGGER template_goes AFTER DELETE ON templates BEGIN
    UPDATE stored_bytes SET bytes = bytes - length(OLD.body) WHERE tenant = OLD.tenant;
END;
