//! Parts of the shared statements in the words of SQLite. There is one writer, so that no locks are needed.

/// Locks the selected rows; rows that another transaction has locked are skipped.
macro_rules! skip_locked {
    () => {
        ""
    };
}

/// Locks the selected rows.
macro_rules! for_update {
    () => {
        ""
    };
}

/// Turns a column into an expression, for which no index is used.
macro_rules! bare {
    ($column:literal) => {
        concat!($column, " || ''")
    };
}

/// A column.
macro_rules! unordered {
    ($column:literal) => {
        $column
    };
}

/// The greater of two values.
macro_rules! greatest {
    () => {
        "MAX"
    };
}

/// The lesser of two values.
macro_rules! least {
    () => {
        "MIN"
    };
}

/// Position of a text in another, 0 if it does not occur.
macro_rules! place_in {
    () => {
        "instr"
    };
}

/// The pairs of the column `labels`, a JSON object.
macro_rules! pairs_of_labels {
    () => {
        "json_each(labels)"
    };
}

/// The current time by which leases are judged: this parameter.
macro_rules! lease_now {
    ($parameter:literal) => {
        $parameter
    };
}

/// 1 if another process is filling a batch, which does not occur here.
macro_rules! being_filled {
    () => {
        "0"
    };
}
