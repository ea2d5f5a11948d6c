//! Parts of the shared statements in the words of PostgreSQL.

words! {
    /// Locks the selected rows; rows that another transaction has locked are skipped.
    skip_locked = " FOR UPDATE SKIP LOCKED";
    /// Locks the selected rows.
    for_update = " FOR UPDATE";
    /// The greater of two values.
    greatest = "GREATEST";
    /// The lesser of two values.
    least = "LEAST";
    /// Position of a text in another, 0 if it does not occur.
    place_in = "strpos";
    /// The pairs of the column `labels`, a JSON object.
    pairs_of_labels = "json_each_text(CAST(labels AS json))";
    /// The current time in ms.
    clock = "CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint)";
    /// 1 if another process is filling a batch.
    being_filled = concat!("CAST(CASE WHEN filled_until > ", clock!(), " THEN 1 ELSE 0 END AS bigint)");
}

/// A column; the planner chooses the index.
macro_rules! bare {
    ($column:literal) => {
        $column
    };
}

/// A column as an expression, so that its order is not used: the planner would scan all jobs from the oldest to find the
/// first queued one.
macro_rules! unordered {
    ($column:literal) => {
        concat!($column, " || ''")
    };
}

/// The current time by which leases are judged: this parameter, or the clock of the database if it is NULL.
macro_rules! lease_now {
    ($parameter:literal) => {
        concat!("COALESCE(", $parameter, ", ", clock!(), ")")
    };
}
