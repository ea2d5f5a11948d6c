//! Rows of a table on their way from one store to another, column by column.

/// The tables that are moved, those first that others refer to. What a database counts itself is counted anew.
pub(crate) const TABLES: [&str; 13] = [
    "templates",
    "batches",
    "blobs",
    "jobs",
    "cases",
    "job_labels",
    "job_slices",
    "blob_outbox",
    "batch_keys",
    "idempotency_keys",
    "tombstones",
    "api_keys",
    "profiles",
];

/// The values of a column, one for each row.
#[derive(Debug)]
pub(crate) enum Values {
    Text(Vec<Option<String>>),
    Integer(Vec<Option<i64>>),
    Real(Vec<Option<f64>>),
    Bytes(Vec<Option<Vec<u8>>>),
}

/// Some rows of a table.
#[derive(Debug)]
pub(crate) struct Portion {
    pub(crate) columns: Vec<(String, Values)>,
    pub(crate) rows: usize,
}
