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

/// Restricts the value before it to a list of texts or, with a type, of numbers. The list is a parameter in JSON.
macro_rules! in_list {
    ($parameter:literal $($kind:literal)?) => {
        concat!(" IN (SELECT value FROM json_each(", $parameter, "))")
    };
}

/// The elements of a JSON array, in the column `value`. `value ->> 0` is the first member of an element as a text.
macro_rules! json_rows {
    ($parameter:literal) => {
        concat!("json_each(", $parameter, ")")
    };
}

/// The current time by which leases are judged: this parameter.
macro_rules! lease_now {
    ($parameter:literal) => {
        $parameter
    };
}

/// Declares a trait of the shared statements. This database is part of every build.
macro_rules! declare {
    ($name:ident $declaration:item) => {
        $declaration
    };
}
