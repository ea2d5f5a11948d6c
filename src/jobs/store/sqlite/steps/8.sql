-- Templates are stored once for each tenant, by their digest, until the last batch that refers to them goes.
CREATE TABLE templates (
    tenant TEXT NOT NULL,
    digest BLOB NOT NULL,
    body   BLOB NOT NULL,
    PRIMARY KEY (tenant, digest)
) STRICT;
ALTER TABLE batches ADD COLUMN template BLOB; -- digest of its template
ALTER TABLE batches ADD COLUMN head BLOB;     -- of a run: its own part of what its chunks share
-- Each template of an earlier form keeps its own row, with the id of its batch as its digest.
INSERT INTO templates (tenant, digest, body)
    SELECT tenant, CAST(batch_id AS BLOB), body FROM batch_templates JOIN batches ON batches.id = batch_id;
UPDATE batches SET template = CAST(id AS BLOB) WHERE id IN (SELECT batch_id FROM batch_templates);
DROP TABLE batch_templates;
CREATE INDEX batches_by_template ON batches (tenant, template) WHERE template IS NOT NULL;
CREATE TRIGGER batch_with_template_goes AFTER DELETE ON batches WHEN OLD.template IS NOT NULL BEGIN
    DELETE FROM templates WHERE tenant = OLD.tenant AND digest = OLD.template
        AND NOT EXISTS (SELECT 1 FROM batches WHERE tenant = OLD.tenant AND template = OLD.template);
END;

-- Bytes of cases, templates and results that a tenant has stored, kept by the database itself in the transaction of every change. Chunks
-- of runs count for their tenant, whose name has no slash.
ALTER TABLE jobs ADD COLUMN case_bytes INTEGER NOT NULL DEFAULT 0;
UPDATE jobs SET case_bytes = COALESCE((SELECT length(body) FROM cases WHERE job_id = jobs.id), 0);
ALTER TABLE blobs ADD COLUMN tenant TEXT;
UPDATE blobs SET tenant = replace(COALESCE(
    (SELECT tenant FROM jobs WHERE blob_id = blobs.id LIMIT 1),
    (SELECT tenant FROM job_slices JOIN jobs ON jobs.id = job_id WHERE job_slices.blob_id = blobs.id LIMIT 1)), '/rows', '');
CREATE TABLE stored_bytes (
    tenant TEXT    NOT NULL PRIMARY KEY,
    bytes  INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
INSERT INTO stored_bytes (tenant, bytes)
    SELECT replace(tenant, '/rows', '') AS owner, SUM(bytes) FROM (
        SELECT tenant, case_bytes AS bytes FROM jobs
        UNION ALL SELECT tenant, length(body) FROM templates
        UNION ALL SELECT tenant, bytes FROM blobs WHERE tenant IS NOT NULL
    ) GROUP BY owner;
CREATE TRIGGER case_comes AFTER INSERT ON jobs BEGIN
    INSERT INTO stored_bytes (tenant, bytes) VALUES (replace(NEW.tenant, '/rows', ''), NEW.case_bytes)
        ON CONFLICT (tenant) DO UPDATE SET bytes = bytes + excluded.bytes;
END;
CREATE TRIGGER case_goes AFTER DELETE ON jobs BEGIN
    UPDATE stored_bytes SET bytes = bytes - OLD.case_bytes WHERE tenant = replace(OLD.tenant, '/rows', '');
END;
CREATE TRIGGER template_comes AFTER INSERT ON templates BEGIN
    INSERT INTO stored_bytes (tenant, bytes) VALUES (replace(NEW.tenant, '/rows', ''), length(NEW.body))
        ON CONFLICT (tenant) DO UPDATE SET bytes = bytes + excluded.bytes;
END;
CREATE TRIGGER template_goes AFTER DELETE ON templates BEGIN
    UPDATE stored_bytes SET bytes = bytes - length(OLD.body) WHERE tenant = replace(OLD.tenant, '/rows', '');
END;
CREATE TRIGGER blob_comes AFTER INSERT ON blobs WHEN NEW.tenant IS NOT NULL BEGIN
    INSERT INTO stored_bytes (tenant, bytes) VALUES (NEW.tenant, NEW.bytes)
        ON CONFLICT (tenant) DO UPDATE SET bytes = bytes + excluded.bytes;
END;
CREATE TRIGGER blob_goes AFTER DELETE ON blobs WHEN OLD.tenant IS NOT NULL BEGIN
    UPDATE stored_bytes SET bytes = bytes - OLD.bytes WHERE tenant = OLD.tenant;
END;
