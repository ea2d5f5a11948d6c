-- Lists of jobs that were submitted alone.
CREATE INDEX jobs_alone ON jobs (tenant, kind, state, id) WHERE batch_id IS NULL;
