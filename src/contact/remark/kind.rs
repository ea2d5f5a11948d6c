//! How severe a remark is, and its entry in the list of all codes.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// How much a remark asks of the client.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// A fact about the answer; nothing needs to be done.
    Info,
    /// The numbers are to be used with care; `advice` of the code says how.
    Warning,
}

/// One kind of remark, explained.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct RemarkKind {
    /// The `code` that remarks of this kind carry; it never changes.
    #[schema(value_type = String, example = "friction-unusual")]
    pub code: &'static str,
    /// How much it asks of the client.
    pub severity: Severity,
    /// What it means.
    #[schema(value_type = String)]
    pub meaning: &'static str,
    /// What to do about it.
    #[schema(value_type = String)]
    pub advice: &'static str,
    /// Names of its figures.
    #[schema(value_type = Vec<String>)]
    pub figures: &'static [&'static str],
    /// The `detail` of a remark of this kind with figures made up.
    pub example: String,
}
