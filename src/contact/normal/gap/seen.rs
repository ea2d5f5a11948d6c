//! What a look at the samples of a gap shows, kept once it was taken: the check of a case asks for it several times, and its solution again.

use crate::contact::normal::gap::pilot::GapPilot;
use crate::contact::normal::gap::search_box::SearchBox;
use crate::contact::once::Once;

/// What is known of a contact before it is solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GapOutlook {
    /// Half-length along rolling and half-width of everything that touches, in mm.
    pub half: [f64; 2],
    /// Approach beyond the least gap, in mm.
    pub depth: f64,
    /// Summits of the bodies that are likely to touch, at least 1.
    pub summits: usize,
    /// How much the gap turns across rolling, over a parabola, its sharpest bend left out.
    pub turns: f64,
    /// Mean height of its teeth over the depth, of a saw that bends as much.
    pub teeth: f64,
}

/// What was seen of a gap so far.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GapSeen {
    /// The box in which contact can be.
    pub(super) reach: Once<SearchBox>,
    /// What the contact will be like.
    pub(super) outlook: Once<GapOutlook>,
    /// The contact on a coarse grid.
    pub(super) pilot: Once<Option<GapPilot>>,
}
