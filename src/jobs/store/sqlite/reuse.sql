-- Results of identical cases are used again.
ALTER TABLE jobs ADD COLUMN reuse_key BLOB;                     -- equal for cases that have the same answer; NULL: never a source
ALTER TABLE jobs ADD COLUMN cached INTEGER NOT NULL DEFAULT 0;  -- 1: the result was computed for another job
ALTER TABLE jobs ADD COLUMN result_owner TEXT;                  -- that job, if the result lies in its folder
CREATE INDEX jobs_by_reuse_key ON jobs (reuse_key) WHERE state = 'succeeded';
CREATE INDEX jobs_by_result_owner ON jobs (result_owner) WHERE result_owner IS NOT NULL;
