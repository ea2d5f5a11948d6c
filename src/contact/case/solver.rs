//! The resolution a case asks for.
//!
//! What one case may use, and the faults of a case that uses more.
//!
//! Cache of the pairs of cross-sections that were read last.
//!
//! Rows of a run, and steps of a simulation, differ in placement, load and motion far more often than in their profiles.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::case::words::cross_section::CrossSection;
use crate::case::words::solver::{MethodName, Solver};
use crate::error::Fault;
use crate::geometry::wheel_rail::{Placement, WheelRail};
use crate::method::Method;
use crate::problem::memory::SizeInput;
use crate::remark::entry::RemarkEntry;
use crate::rolling::methods::fastsim;
use crate::rolling::operator_store::BYTES_DEFAULT;
use crate::rolling::task::{Resolution, TARGET_USUAL};

pub(crate) fn resolution(solver: &Solver) -> Resolution {
    match (solver.mesh, solver.target_error) {
        (Some(size), _) => Resolution::Mesh(size.into()),
        // As it would solve for any target.
        (None, None) if solver.method == MethodName::Fastsim => Resolution::Mesh(fastsim::MESH),
        (None, target) => Resolution::Target(target.unwrap_or(TARGET_USUAL)),
    }
}

/// What one solve may use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Estimated memory of one case in bytes.
    pub memory_bytes: u64,
    /// Bound of the store of operators that it shares with others, in bytes.
    pub operator_store_bytes: u64,
    /// Motions in one case.
    pub motions_max: usize,
    /// Samples of a grid (one axis times the other).
    pub samples_max: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            memory_bytes: 2 << 30,
            operator_store_bytes: BYTES_DEFAULT,
            motions_max: 10_000,
            samples_max: 1_000_000,
        }
    }
}

/// Largest length over width of a patch for the fast solver. Its preconditioner treats every strip by itself, so that linear systems no
/// longer converge where strips lie closer than the cells in them are long. Of ellipses under 20 loads and motions all converged up
/// to 70, and from 100 on some did not (`cargo bench --bench stress` goes to 50). Wide patches need no bound: b/a 1000 converges in
/// a few steps.
const LENGTH_OVER_WIDTH_MAX: f64 = 60.0;
/// Most cells of the dense method, whose matrices of 2000 unknowns take 32 MB each and 5 Gflop to factor. Chosen by judgement; how much it
/// matters was not measured.
const LIU_HSU_CELLS_MAX: f64 = 1000.0;

impl SizeInput {
    /// Faults of a case that is too large for the limits or for its method.
    pub(crate) fn faults(&self, limits: &Limits) -> Vec<Fault> {
        let pointer = match self.resolution {
            Resolution::Mesh(_) => "/solver/mesh",
            Resolution::Target(_) => "/contact",
        };
        let mut faults = Vec::new();
        let (cells, _) = self.finest();
        if self.method == Method::LiuHsu && cells > LIU_HSU_CELLS_MAX {
            faults.push(Fault::new(pointer, format!(
                    "{cells:.0} cells over all patches; at most {LIU_HSU_CELLS_MAX} are allowed with liu_hsu, \
                     use boundary_element for more"
                )));
        }
        let fast = matches!(self.method, Method::BoundaryElement);
        if let Some(ratio) = self
            .ellipse
            .filter(|ratio| fast && *ratio > LENGTH_OVER_WIDTH_MAX)
        {
            faults.push(Fault::new("/contact", format!(
                    "a patch {ratio:.1} times as long along rolling as wide; boundary_element solves up to \
                     {LENGTH_OVER_WIDTH_MAX} times, fastsim any"
                )));
        }
        let bytes = self.bytes() as u64;
        if bytes > limits.memory_bytes {
            let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
            faults.push(Fault::new(pointer, format!(
                    "{cells:.0} cells over all patches and {} motions need about {:.0} MiB; at most {:.0} MiB are \
                     allowed for one case",
                    self.motions,
                    mebibytes(bytes),
                    mebibytes(limits.memory_bytes)
                )));
        }
        faults
    }
}

/// Pairs kept: those of a few vehicles, left and right, whose steps alternate.
const PAIRS_MAX: usize = 16;

/// The pairs read last, the most recent first.
#[derive(Debug, Default)]
pub struct KnownPair(Mutex<Vec<Arc<PairRead>>>);

/// The members of a case that describe a pair of cross-sections, without its placement.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PairWords<'a> {
    /// Rail and wheel.
    pub(crate) sections: [&'a CrossSection; 2],
    /// y of the back of the flange, if the case states it.
    pub(crate) flange_back: Option<f64>,
    /// Whether rough or exchanged profiles are accepted.
    pub(crate) accept_rough: bool,
}

/// A wheel over its rail, with a remark on the back of its flange.
pub(crate) type Placed = (WheelRail, Option<RemarkEntry>);

/// A pair with the remark on its flange, and the words that it was read from.
#[derive(Debug)]
struct PairRead {
    sections: [CrossSection; 2],
    flange_back: Option<f64>,
    accept_rough: bool,
    placed: Placed,
}

/// Whether the track is the same, for any placement of the wheelset. The back of the flange is compared as it was stated.
fn on_same_track(one: &Placement, other: &Placement) -> bool {
    let track = |placement: &Placement| Placement {
        lateral_shift: 0.0,
        yaw: 0.0,
        roll: 0.0,
        flange_back_position: 0.0,
        ..*placement
    };
    track(one) == track(other)
}

impl KnownPair {
    /// The pair of rail and wheel in their places: the one that is kept, or the one that `read` finds without faults.
    pub(crate) fn placed(
        &self,
        words: &PairWords,
        placement: &Placement,
        read: impl FnOnce() -> Result<Placed, Vec<Fault>>,
    ) -> Result<Placed, Vec<Fault>> {
        let mut pairs = self.pairs();
        let found = pairs.iter().position(|known| {
            known.flange_back == words.flange_back
                && known.accept_rough == words.accept_rough
                && on_same_track(&known.placed.0.placement, placement)
                && [0, 1]
                    .iter()
                    .all(|k| known.sections[*k] == *words.sections[*k])
        });
        let known = found.map(|found| {
            pairs[..=found].rotate_right(1);
            Arc::clone(&pairs[0])
        });
        drop(pairs);
        let pair = match known {
            Some(pair) => pair,
            None => {
                let pair = Arc::new(PairRead {
                    sections: words.sections.map(CrossSection::clone),
                    flange_back: words.flange_back,
                    accept_rough: words.accept_rough,
                    placed: read()?,
                });
                let mut pairs = self.pairs();
                pairs.insert(0, Arc::clone(&pair));
                pairs.truncate(PAIRS_MAX);
                pair
            }
        };
        let Placement {
            lateral_shift,
            yaw,
            roll,
            ..
        } = *placement;
        let (geometry, remark) = &pair.placed;
        Ok((geometry.posed(lateral_shift, yaw, roll), remark.clone()))
    }

    fn pairs(&self) -> MutexGuard<'_, Vec<Arc<PairRead>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
