//! A number or word of a remark.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A number or a word in a remark.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(untagged)]
pub enum Figure {
    /// A finite number.
    Number(f64),
    /// Several numbers.
    Numbers(Vec<f64>),
    /// A word.
    Word(String),
}

/// Types that can be a figure of a remark.
pub(crate) trait AsFigure {
    /// The figure; `None` for a number that is absent or not finite.
    fn figure(&self) -> Option<Figure>;
}

impl AsFigure for [f64; 2] {
    fn figure(&self) -> Option<Figure> {
        let finite = self.iter().all(|part| part.is_finite());
        finite.then(|| Figure::Numbers(self.to_vec()))
    }
}

impl AsFigure for &'static str {
    fn figure(&self) -> Option<Figure> {
        Some(Figure::Word((*self).to_owned()))
    }
}
