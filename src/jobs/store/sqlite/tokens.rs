//! Parts of the shared statements in the words of SQLite. There is one writer, so that no locks are needed.

words! {
    /// Locks the selected rows; rows that another transaction has locked are skipped.
    skip_locked = "";
    /// Locks the selected rows.
    for_update = "";
    /// The greater of two values.
    greatest = "MAX";
    /// The lesser of two values.
    least = "MIN";
    /// Position of a text in another, 0 if it does not occur.
    place_in = "instr";
    /// The pairs of the column `labels`, a JSON object.
    pairs_of_labels = "json_each(labels)";
    /// 1 if another process is filling a batch, which does not occur here.
    being_filled = "0";
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

/// The current time by which leases are judged: this parameter.
macro_rules! lease_now {
    ($parameter:literal) => {
        $parameter
    };
}
