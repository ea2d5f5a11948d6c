-- A database knows itself, where its large results are, and which programs may use its tables.
ALTER TABLE deployment
    ADD COLUMN id            text COLLATE "C" NOT NULL DEFAULT CAST(gen_random_uuid() AS text),
    ADD COLUMN readable_from bigint NOT NULL DEFAULT 2, -- oldest form whose programs may use the tables
    ADD COLUMN results_place text,                      -- URL of the results; '': in this database; NULL: not decided
    ADD COLUMN swept_at      bigint NOT NULL DEFAULT CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint);
