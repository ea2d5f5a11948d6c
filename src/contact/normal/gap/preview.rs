//! Preview of a contact from the samples of its gap, cached because check and solution use it several times.

use crate::contact::lazy_field::LazyField;
use crate::contact::normal::gap::search_box::SearchBox;

/// Estimates of a contact before it is solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GapPreview {
    /// Half-length along rolling and half-width of everything that touches, in mm.
    pub half: [f64; 2],
    /// Approach beyond the least gap, in mm.
    pub depth: f64,
    /// Asperities of the bodies that are likely to touch, at least 1.
    pub asperities: usize,
}

/// The cached parts of a preview.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PreviewCache {
    /// The box in which contact can be.
    pub(super) reach: LazyField<SearchBox>,
    /// Size and roughness of the contact.
    pub(super) preview: LazyField<GapPreview>,
}
