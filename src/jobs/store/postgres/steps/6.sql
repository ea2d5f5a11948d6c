-- Kinds of work. Runs belonged to a tenant of their own, '<tenant>/rows'; now they are batches of the kind 'rows', and their chunks jobs of it.
ALTER TABLE jobs ADD COLUMN kind text COLLATE "C" NOT NULL DEFAULT 'case' CHECK (kind IN ('case', 'rows')); -- what the body is
ALTER TABLE batches ADD COLUMN kind text COLLATE "C" NOT NULL DEFAULT 'cases' CHECK (kind IN ('cases', 'rows'));

DROP INDEX jobs_by_state, jobs_by_tenant, jobs_queued, jobs_begun, batches_by_tenant;

ALTER TABLE jobs DISABLE TRIGGER USER;
UPDATE jobs SET kind = 'rows', tenant = replace(tenant, '/rows', '') WHERE tenant LIKE '%/rows';
ALTER TABLE jobs ENABLE TRIGGER USER;
-- The triggers count a template that both have once.
INSERT INTO templates (tenant, digest, body)
    SELECT replace(tenant, '/rows', ''), digest, body FROM templates WHERE tenant LIKE '%/rows' ON CONFLICT DO NOTHING;
UPDATE batches SET kind = 'rows', tenant = replace(tenant, '/rows', '') WHERE tenant LIKE '%/rows';
DELETE FROM templates WHERE tenant LIKE '%/rows';
UPDATE tombstones SET tenant = replace(tenant, '/rows', '') WHERE tenant LIKE '%/rows';

-- A key may stand for a batch and for a run.
ALTER TABLE batch_keys ADD COLUMN kind text COLLATE "C" NOT NULL DEFAULT 'cases'; -- of the batch
ALTER TABLE batch_keys DROP CONSTRAINT batch_keys_pkey;
UPDATE batch_keys SET kind = 'rows', of_tenant = replace(of_tenant, '/rows', '') WHERE of_tenant LIKE '%/rows';
ALTER TABLE batch_keys ADD PRIMARY KEY (of_tenant, kind, key);
ALTER TABLE batch_keys ALTER kind DROP DEFAULT;

ALTER TABLE job_counts ADD COLUMN kind text COLLATE "C" NOT NULL DEFAULT 'case';
UPDATE job_counts SET kind = 'rows', tenant = replace(tenant, '/rows', '') WHERE tenant LIKE '%/rows';
ALTER TABLE job_counts ALTER kind DROP DEFAULT;
DROP INDEX job_counts_by_state;
CREATE INDEX job_counts_by_state ON job_counts (state, tenant, kind) INCLUDE (number);

CREATE INDEX jobs_by_state ON jobs (state, tenant, kind, id);
CREATE INDEX jobs_by_tenant ON jobs (tenant, kind, id);
CREATE INDEX jobs_queued ON jobs (tenant, kind, rank, id) WHERE state = 'queued';
CREATE INDEX jobs_begun ON jobs (tenant, kind, rank, id) WHERE state = 'queued' AND slices > 0;
CREATE INDEX batches_by_tenant ON batches (tenant, kind, id) WHERE complete = 1;

CREATE OR REPLACE FUNCTION jobs_came() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO job_counts (state, tenant, kind, number) SELECT state, tenant, kind, COUNT(*) FROM came GROUP BY state, tenant, kind;
    INSERT INTO stored_bytes (tenant, bytes) SELECT tenant, SUM(case_bytes) FROM came GROUP BY 1 HAVING SUM(case_bytes) <> 0;
    RETURN NULL;
END $$;
CREATE OR REPLACE FUNCTION jobs_went() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO job_counts (state, tenant, kind, number) SELECT state, tenant, kind, -COUNT(*) FROM went GROUP BY state, tenant, kind;
    INSERT INTO stored_bytes (tenant, bytes) SELECT tenant, -SUM(case_bytes) FROM went GROUP BY 1 HAVING SUM(case_bytes) <> 0;
    RETURN NULL;
END $$;
CREATE OR REPLACE FUNCTION jobs_moved() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO job_counts (state, tenant, kind, number)
        SELECT state, tenant, kind, SUM(number) FROM
            (SELECT state, tenant, kind, -1 AS number FROM before UNION ALL SELECT state, tenant, kind, 1 FROM after) AS moves
        GROUP BY state, tenant, kind HAVING SUM(number) <> 0;
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
CREATE OR REPLACE FUNCTION templates_came() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO stored_bytes (tenant, bytes) SELECT tenant, octet_length(body) FROM came;
    RETURN NULL;
END $$;
CREATE OR REPLACE FUNCTION templates_went() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO stored_bytes (tenant, bytes) SELECT tenant, -octet_length(body) FROM went;
    RETURN NULL;
END $$;
