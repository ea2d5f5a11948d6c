-- Keys may be bound to labels: such a key opens only what carries them.
ALTER TABLE api_keys ADD COLUMN labels text NOT NULL DEFAULT '{}';
