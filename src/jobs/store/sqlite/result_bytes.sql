-- Size of a result that lies in a folder.
ALTER TABLE jobs ADD COLUMN result_bytes INTEGER;
CREATE INDEX jobs_by_result_bytes ON jobs (result_bytes) WHERE result_bytes IS NOT NULL;
