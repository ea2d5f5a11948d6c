//! Tables of rows: named columns of numbers and texts.

use railhead_contact::evaluate::varied::Values;
use serde::Serialize;
use utoipa::ToSchema;

/// Most columns of a table that is read. A case has far fewer members that a row can vary.
pub const COLUMNS_MAX: usize = 1000;

/// The values of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum TableColumn {
    /// Integers, one per row.
    Integers(Vec<i64>),
    /// Numbers; NaN if a row has none.
    Numbers(Vec<f64>),
    /// Texts; `None` if a row has none.
    Texts(Vec<Option<String>>),
}

/// Type of the values of a result column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[schema(as = AnswerColumnKind)]
pub enum TableKind {
    /// Whole numbers.
    #[serde(rename = "integer")]
    Integers,
    /// Numbers, null where a row has none.
    #[serde(rename = "number")]
    Numbers,
    /// Texts, null where a row has none.
    #[serde(rename = "text")]
    Texts,
}

/// The title of a column of a client's table.
#[derive(Debug, Clone, PartialEq)]
pub struct Title {
    /// The title as sent.
    pub name: String,
    /// The unit in a line of units below the titles.
    pub unit: Option<String>,
    /// Whether the column holds texts; otherwise it holds numbers.
    pub text: bool,
    /// Whether the values of a column that is copied to the results are kept as texts: CSV of names, and of numbers such as `007`.
    pub text_if_copied: bool,
}

/// Some rows, column by column; a number is NaN if a row has none.
pub type Chunk = Vec<Values>;

/// Columns of the same length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RowTable {
    /// Names and values, in order.
    pub columns: Vec<(String, TableColumn)>,
}

impl TableColumn {
    /// Returns the number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            TableColumn::Integers(values) => values.len(),
            TableColumn::Numbers(values) => values.len(),
            TableColumn::Texts(values) => values.len(),
        }
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the kind of the values.
    #[must_use]
    pub fn kind(&self) -> TableKind {
        match self {
            TableColumn::Integers(_) => TableKind::Integers,
            TableColumn::Numbers(_) => TableKind::Numbers,
            TableColumn::Texts(_) => TableKind::Texts,
        }
    }

    /// Keeps only these rows.
    #[must_use]
    pub fn slice(self, range: std::ops::Range<usize>) -> TableColumn {
        fn cut<T>(mut values: Vec<T>, range: std::ops::Range<usize>) -> Vec<T> {
            values.truncate(range.end);
            values.drain(..range.start);
            values
        }
        match self {
            TableColumn::Integers(values) => TableColumn::Integers(cut(values, range)),
            TableColumn::Numbers(values) => TableColumn::Numbers(cut(values, range)),
            TableColumn::Texts(values) => TableColumn::Texts(cut(values, range)),
        }
    }
}

impl TableKind {
    /// Returns a column of this many rows without values.
    #[must_use]
    pub fn without_values(self, rows: usize) -> TableColumn {
        match self {
            TableKind::Integers => TableColumn::Integers(vec![0; rows]),
            TableKind::Numbers => TableColumn::Numbers(vec![f64::NAN; rows]),
            TableKind::Texts => TableColumn::Texts(vec![None; rows]),
        }
    }
}

impl RowTable {
    /// Returns the names of the columns with their kinds.
    #[must_use]
    pub fn kinds(&self) -> Vec<(String, TableKind)> {
        let columns = self.columns.iter();
        columns
            .map(|(name, column)| (name.clone(), column.kind()))
            .collect()
    }

    /// Returns the number of rows.
    #[must_use]
    pub fn row_count(&self) -> usize {
        self.columns.first().map_or(0, |(_, column)| column.len())
    }

    /// Returns a column by its name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&TableColumn> {
        let mut columns = self.columns.iter();
        columns
            .find(|(known, _)| known == name)
            .map(|(_, column)| column)
    }

    /// Keeps only these rows.
    #[must_use]
    pub fn cut(self, range: &std::ops::Range<usize>) -> RowTable {
        let columns = self.columns.into_iter();
        RowTable {
            columns: columns
                .map(|(name, column)| (name, column.slice(range.clone())))
                .collect(),
        }
    }
}
