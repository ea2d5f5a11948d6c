-- What a client may wish for its jobs: an order among its own, an end in time, and not to get an earlier result.
ALTER TABLE jobs ADD COLUMN rank INTEGER NOT NULL DEFAULT 1;   -- 0: high priority, 1: normal, 2: low
ALTER TABLE jobs ADD COLUMN deadline INTEGER;                  -- a job that has not ended by then fails
ALTER TABLE jobs ADD COLUMN fresh INTEGER NOT NULL DEFAULT 0;  -- 1: solved even if an identical case was solved before

-- The claim: the next job of the tenant whose turn it is. Jobs leave it when they are claimed.
CREATE INDEX jobs_queued ON jobs (tenant, rank, id) WHERE state = 'queued';
CREATE INDEX jobs_by_deadline ON jobs (deadline) WHERE deadline IS NOT NULL AND ended_at IS NULL;
