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

/// Restricts the value before it to a list of texts or, with a type, of numbers. The list is a parameter in JSON.
macro_rules! in_list {
    ($parameter:literal) => {
        in_list!($parameter "text")
    };
    ($parameter:literal $kind:literal) => {
        concat!(" = ANY(ARRAY(SELECT CAST(value AS ", $kind, ") FROM json_array_elements_text(CAST(", $parameter, " AS json))))")
    };
}

/// The elements of a JSON array, in the column `value`. `value ->> 0` is the first member of an element as a text.
macro_rules! json_rows {
    ($parameter:literal) => {
        concat!("json_array_elements(CAST(", $parameter, " AS json))")
    };
}

/// The current time by which leases are judged: this parameter, or the clock of the database if it is NULL.
macro_rules! lease_now {
    ($parameter:literal) => {
        concat!("COALESCE(", $parameter, ", ", clock!(), ")")
    };
}

/// Imports a trait of the shared statements, which the embedded database declares.
macro_rules! declare {
    ($name:ident $declaration:item) => {
        use crate::store::$name;
    };
}
