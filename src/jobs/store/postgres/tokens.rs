//! Parts of the shared statements in the words of PostgreSQL.

/// Locks the selected rows; rows that another transaction has locked are skipped.
macro_rules! skip_locked {
    () => {
        " FOR UPDATE SKIP LOCKED"
    };
}

/// Locks the selected rows.
macro_rules! for_update {
    () => {
        " FOR UPDATE"
    };
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

/// The greater of two values.
macro_rules! greatest {
    () => {
        "GREATEST"
    };
}

/// The lesser of two values.
macro_rules! least {
    () => {
        "LEAST"
    };
}

/// Position of a text in another, 0 if it does not occur.
macro_rules! place_in {
    () => {
        "strpos"
    };
}

/// The pairs of the column `labels`, a JSON object.
macro_rules! pairs_of_labels {
    () => {
        "json_each_text(CAST(labels AS json))"
    };
}

/// The current time by which leases are judged: this parameter, or the clock of the database if it is NULL.
macro_rules! lease_now {
    ($parameter:literal) => {
        concat!(
            "COALESCE(",
            $parameter,
            ", CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint))"
        )
    };
}

/// 1 if another process is filling a batch.
macro_rules! being_filled {
    () => {
        "CAST(CASE WHEN filled_until > CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint) THEN 1 ELSE 0 END AS bigint)"
    };
}
