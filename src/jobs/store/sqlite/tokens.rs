//! What SQLite says otherwise than the other databases, as pieces of the statements they share. There is one writer, so that
//! nothing has to be locked.

/// Locks the rows of a selection; those that another transaction has locked are left out.
macro_rules! skip_locked {
    () => {
        ""
    };
}

/// Locks the rows of a selection, once whoever else has locked them is done.
macro_rules! for_update {
    () => {
        ""
    };
}

/// Makes of a column an expression that no index is used for.
macro_rules! bare {
    ($column:literal) => {
        concat!($column, " || ''")
    };
}

/// A column as it is.
macro_rules! unordered {
    ($column:literal) => {
        $column
    };
}

/// The larger of two values.
macro_rules! greatest {
    () => {
        "MAX"
    };
}

/// The smaller of two values.
macro_rules! least {
    () => {
        "MIN"
    };
}

/// Place of a text in another, 0 if it is not in there.
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

/// The present by which leases are judged: this parameter.
macro_rules! lease_now {
    ($parameter:literal) => {
        $parameter
    };
}

/// 1 if some process is filling a batch. Which ones this process fills it knows itself, and there is no other.
macro_rules! being_filled {
    () => {
        "0"
    };
}
