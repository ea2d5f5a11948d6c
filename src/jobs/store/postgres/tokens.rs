//! What PostgreSQL says otherwise than the other databases, as pieces of the statements they share.

/// Locks the rows of a selection; those that another transaction has locked are left out.
macro_rules! skip_locked {
    () => {
        " FOR UPDATE SKIP LOCKED"
    };
}

/// Locks the rows of a selection, once whoever else has locked them is done.
macro_rules! for_update {
    () => {
        " FOR UPDATE"
    };
}

/// A column; which index is used is the planner's choice.
macro_rules! bare {
    ($column:literal) => {
        $column
    };
}

/// A column whose order is not used: the planner would walk all jobs from the oldest to find the first that is queued.
macro_rules! unordered {
    ($column:literal) => {
        concat!($column, " || ''")
    };
}

/// The larger of two values.
macro_rules! greatest {
    () => {
        "GREATEST"
    };
}

/// The smaller of two values.
macro_rules! least {
    () => {
        "LEAST"
    };
}

/// Place of a text in another, 0 if it is not in there.
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

/// The present by which leases are judged: this parameter, or the database's clock if it is NULL.
macro_rules! lease_now {
    ($parameter:literal) => {
        concat!(
            "COALESCE(",
            $parameter,
            ", CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint))"
        )
    };
}

/// 1 if some process is filling a batch: its lease has not run out.
macro_rules! being_filled {
    () => {
        "CAST(CASE WHEN filled_until > CAST(extract(epoch FROM clock_timestamp()) * 1000 AS bigint) THEN 1 ELSE 0 END AS bigint)"
    };
}
