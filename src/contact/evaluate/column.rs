//! A column of numbers.

/// A column: where it stands in the case, and a number for each row.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// JSON pointer into the case.
    pub pointer: String,
    /// The numbers.
    pub values: Vec<f64>,
}
