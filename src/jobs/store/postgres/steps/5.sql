-- Templates are stored once for each tenant, by their digest, until the last batch that refers to them goes.
CREATE TABLE templates (
    tenant text  COLLATE "C" NOT NULL,
    digest bytea NOT NULL,
    body   bytea NOT NULL,
    PRIMARY KEY (tenant, digest)
);
ALTER TABLE batches
    ADD COLUMN template bytea, -- digest of its template
    ADD COLUMN head     bytea; -- of a run: its own part of what its chunks share
-- Each template of an earlier form keeps its own row, with the id of its batch as its digest.
INSERT INTO templates (tenant, digest, body)
    SELECT tenant, convert_to(batch_id, 'UTF8'), body FROM batch_templates JOIN batches ON batches.id = batch_id;
UPDATE batches SET template = convert_to(id, 'UTF8') WHERE id IN (SELECT batch_id FROM batch_templates);
DROP TABLE batch_templates;
ALTER TABLE batches ADD FOREIGN KEY (tenant, template) REFERENCES templates (tenant, digest);
CREATE INDEX batches_by_template ON batches (tenant, template) WHERE template IS NOT NULL;
CREATE FUNCTION batch_with_template_went() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    -- Of two transactions that remove the last two batches, the later has to see that the other one is gone.
    PERFORM 1 FROM templates WHERE tenant = OLD.tenant AND digest = OLD.template FOR UPDATE;
    DELETE FROM templates WHERE tenant = OLD.tenant AND digest = OLD.template
        AND NOT EXISTS (SELECT 1 FROM batches WHERE tenant = OLD.tenant AND template = OLD.template);
    RETURN NULL;
END $$;
CREATE TRIGGER batch_with_template_goes AFTER DELETE ON batches
    FOR EACH ROW WHEN (OLD.template IS NOT NULL) EXECUTE FUNCTION batch_with_template_went();

-- Bytes of cases, templates and results that a tenant has stored: the sum of these rows, as with `job_counts`. Chunks of runs count for
-- their tenant, whose name has no slash.
ALTER TABLE jobs ADD COLUMN case_bytes bigint NOT NULL DEFAULT 0;
ALTER TABLE jobs DISABLE TRIGGER USER;
UPDATE jobs SET case_bytes = octet_length(body) FROM cases WHERE job_id = jobs.id;
ALTER TABLE jobs ENABLE TRIGGER USER;
ALTER TABLE blobs ADD COLUMN tenant text COLLATE "C";
UPDATE blobs SET tenant = replace(COALESCE(
    (SELECT tenant FROM jobs WHERE blob_id = blobs.id LIMIT 1),
    (SELECT tenant FROM job_slices JOIN jobs ON jobs.id = job_id WHERE job_slices.blob_id = blobs.id LIMIT 1)), '/rows', '');
CREATE TABLE stored_bytes (
    tenant text   COLLATE "C" NOT NULL,
    bytes  bigint NOT NULL
) WITH (autovacuum_vacuum_scale_factor = 0.1, autovacuum_vacuum_threshold = 1000, autovacuum_vacuum_cost_delay = 0);
CREATE INDEX stored_bytes_by_tenant ON stored_bytes (tenant) INCLUDE (bytes);
INSERT INTO stored_bytes (tenant, bytes)
    SELECT replace(tenant, '/rows', ''), SUM(bytes) FROM (
        SELECT tenant, case_bytes AS bytes FROM jobs
        UNION ALL SELECT tenant, octet_length(body) FROM templates
        UNION ALL SELECT tenant, bytes FROM blobs WHERE tenant IS NOT NULL
    ) AS stored GROUP BY 1;

CREATE OR REPLACE FUNCTION jobs_came() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO job_counts (state, tenant, number) SELECT state, tenant, COUNT(*) FROM came GROUP BY state, tenant;
    INSERT INTO stored_bytes (tenant, bytes)
        SELECT replace(tenant, '/rows', ''), SUM(case_bytes) FROM came GROUP BY 1 HAVING SUM(case_bytes) <> 0;
    RETURN NULL;
END $$;
CREATE OR REPLACE FUNCTION jobs_went() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO job_counts (state, tenant, number) SELECT state, tenant, -COUNT(*) FROM went GROUP BY state, tenant;
    INSERT INTO stored_bytes (tenant, bytes)
        SELECT replace(tenant, '/rows', ''), -SUM(case_bytes) FROM went GROUP BY 1 HAVING SUM(case_bytes) <> 0;
    RETURN NULL;
END $$;

CREATE FUNCTION templates_came() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO stored_bytes (tenant, bytes) SELECT replace(tenant, '/rows', ''), octet_length(body) FROM came;
    RETURN NULL;
END $$;
CREATE TRIGGER templates_come AFTER INSERT ON templates REFERENCING NEW TABLE AS came
    FOR EACH STATEMENT EXECUTE FUNCTION templates_came();
CREATE FUNCTION templates_went() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO stored_bytes (tenant, bytes) SELECT replace(tenant, '/rows', ''), -octet_length(body) FROM went;
    RETURN NULL;
END $$;
CREATE TRIGGER templates_go AFTER DELETE ON templates REFERENCING OLD TABLE AS went
    FOR EACH STATEMENT EXECUTE FUNCTION templates_went();

CREATE FUNCTION blobs_came() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO stored_bytes (tenant, bytes) SELECT tenant, SUM(bytes) FROM came WHERE tenant IS NOT NULL GROUP BY tenant;
    RETURN NULL;
END $$;
CREATE TRIGGER blobs_come AFTER INSERT ON blobs REFERENCING NEW TABLE AS came
    FOR EACH STATEMENT EXECUTE FUNCTION blobs_came();
CREATE FUNCTION blobs_went() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO stored_bytes (tenant, bytes) SELECT tenant, -SUM(bytes) FROM went WHERE tenant IS NOT NULL GROUP BY tenant;
    RETURN NULL;
END $$;
CREATE TRIGGER blobs_go AFTER DELETE ON blobs REFERENCING OLD TABLE AS went
    FOR EACH STATEMENT EXECUTE FUNCTION blobs_went();
