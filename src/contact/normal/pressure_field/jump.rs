//! A jump of a sampled pressure.

/// A place where a pressure falls from one sample to the next more steeply than at any edge of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump {
    /// Coordinates in mm, halfway between the two samples.
    pub at: [f64; 2],
    /// The fall over the largest pressure.
    pub fall: f64,
}
