//! Meshes, tractions for predictions, and buffers, kept from one motion of a footprint to the next.

use std::cell::OnceCell;
use std::sync::Arc;

use crate::contact::rolling::load_ellipse::LoadEllipse;
use crate::contact::rolling::methods::boundary_element::workspace::NewtonWorkspace;
use crate::contact::rolling::operator_store::OperatorStore;
use crate::contact::rolling::refinement::levels::Levels;
use crate::contact::rolling::refinement::predictor::Predictor;
use crate::contact::rolling::task::RollingTask;

/// The state of the refinement of one footprint. It saves time and never changes a mesh or an estimate.
#[derive(Debug)]
pub struct RefinementState<'a> {
    task: &'a RollingTask<'a>,
    /// The meshes that exist.
    pub levels: Levels<'a>,
    /// Tractions of the last motions.
    pub predictor: Predictor,
    /// Buffers of the iterations on all meshes.
    pub workspace: NewtonWorkspace,
    /// Equivalent ellipses of the patches.
    ellipses: OnceCell<Vec<LoadEllipse>>,
}

impl<'a> RefinementState<'a> {
    /// The state before the first motion; operators come from a store.
    #[must_use]
    pub fn new(task: &'a RollingTask<'a>, store: &Arc<OperatorStore>) -> RefinementState<'a> {
        RefinementState {
            task,
            levels: Levels::new(task, store),
            predictor: Predictor::default(),
            workspace: NewtonWorkspace::of_thread(),
            ellipses: OnceCell::new(),
        }
    }

    /// The equivalent ellipses of the patches, computed on first use.
    pub fn ellipses(&self) -> &[LoadEllipse] {
        let footprint = self.task.footprint;
        let all = 0..footprint.patches().len();
        self.ellipses
            .get_or_init(|| all.map(|patch| LoadEllipse::of(footprint, patch)).collect())
    }

    /// Drops the least recently used meshes and the tractions on them. Called between motions: no answer may refer to a mesh by its number
    /// after that.
    pub fn trim(&mut self) {
        for number in self.levels.trim() {
            self.predictor.forget(number);
        }
    }
}

impl Drop for RefinementState<'_> {
    fn drop(&mut self) {
        std::mem::take(&mut self.workspace).give_back();
    }
}
