//! The meshes of a footprint that exist: made once, shared by all motions, the least recently used dropped.

use std::sync::Arc;

use crate::contact::error::SolveError;
use crate::contact::rolling::operator_store::{CaseOperators, OperatorStore};
use crate::contact::rolling::resolution::MeshPlan;
use crate::contact::rolling::strip_mesh::StripMesh;
use crate::contact::rolling::task::RollingTask;

/// Levels that are kept from one motion to the next: a few paths of about four levels. Sweeps return to the levels of the last few
/// motions only; in a creep map of 900 motions at fixed spin, half as many make no difference (`cargo bench --bench stress -- --only
/// creep-map`).
pub const LEVELS_KEPT: usize = 32;

/// The levels of a case that exist; the least recently used are dropped between motions.
#[derive(Debug)]
pub struct Levels<'a> {
    task: &'a RollingTask<'a>,
    operators: Arc<CaseOperators>,
    /// With their numbers, which are never given twice, in the order of their last use.
    kept: Vec<(usize, Arc<StripMesh>)>,
    made: usize,
}

impl<'a> Levels<'a> {
    /// No levels yet; their operators come from a store.
    #[must_use]
    pub fn new(task: &'a RollingTask<'a>, store: &Arc<OperatorStore>) -> Levels<'a> {
        Levels {
            task,
            operators: CaseOperators::new(store),
            kept: Vec::new(),
            made: 0,
        }
    }

    /// The number of the level of this plan; it is made if it is not there.
    ///
    /// # Errors
    /// If no strip meets a patch.
    pub fn level(&mut self, plan: MeshPlan) -> Result<usize, SolveError> {
        if let Some(place) = self.kept.iter().position(|(_, level)| level.plan == plan) {
            // The most recently used stand last.
            self.kept[place..].rotate_left(1);
            return Ok(self.kept[self.kept.len() - 1].0);
        }
        let operators = Arc::clone(&self.operators);
        let level = StripMesh::with_operators(self.task, plan, operators)?;
        self.kept.push((self.made, Arc::new(level)));
        self.made += 1;
        Ok(self.made - 1)
    }

    /// A level by its number; it must have been used since the last [`Levels::trim`].
    #[must_use]
    pub fn get(&self, level: usize) -> Arc<StripMesh> {
        let found = self.kept.iter().rev().find(|(number, _)| *number == level);
        let Some((_, level)) = found else {
            unreachable!("level {level} was dropped while it was in use")
        };
        Arc::clone(level)
    }

    /// Drops the least recently used levels beyond [`LEVELS_KEPT`] and gives their numbers. Called between motions: no answer may refer to
    /// a level by its number after that.
    pub fn trim(&mut self) -> Vec<usize> {
        let surplus = self.kept.len().saturating_sub(LEVELS_KEPT);
        let dropped = self.kept.drain(..surplus);
        dropped.map(|(number, _)| number).collect()
    }
}
