-- Cross-sections that cases name by their digest.
CREATE TABLE profiles (
    tenant     text COLLATE "C" NOT NULL,
    digest     text COLLATE "C" NOT NULL,
    body       bytea            NOT NULL,
    bytes      bigint           NOT NULL,
    created_at bigint           NOT NULL,
    PRIMARY KEY (tenant, digest)
);
