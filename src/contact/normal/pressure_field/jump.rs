//! A discontinuity of a sampled pressure.

/// A discontinuity: the pressure falls from one sample to the next more steeply than at the edge of any smooth contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump {
    /// Coordinates in mm, halfway between the two samples.
    pub at: [f64; 2],
    /// The fall relative to the largest pressure.
    pub fall: f64,
}
