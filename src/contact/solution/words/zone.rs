//! Stick or slip: the words for what a cell does.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What a cell of the contact patch does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Zone {
    /// No relative slip.
    Stick,
    /// The friction bound is reached and the surfaces slip.
    Slip,
}

impl Zone {
    /// The word for this zone in every text.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Zone::Stick => "stick",
            Zone::Slip => "slip",
        }
    }
}
