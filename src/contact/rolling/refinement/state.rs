//! What refinement keeps from one motion of a footprint to the next: levels, what a sweep left on them, and buffers.

use std::cell::OnceCell;
use std::sync::Arc;

use crate::contact::rolling::load_ellipse::LoadEllipse;
use crate::contact::rolling::methods::boundary_element::workspace::NewtonWorkspace;
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::operator_store::OperatorStore;
use crate::contact::rolling::refinement::levels::Levels;
use crate::contact::rolling::refinement::mesh_policy::MeshPolicy;
use crate::contact::rolling::refinement::table_check::CoveredPatch;
use crate::contact::rolling::refinement::warm_start::{SweepState, nested_tractions};
use crate::contact::rolling::task::RollingTask;

/// The state of the refinement of one footprint.
#[derive(Debug)]
pub struct RefinementState<'a> {
    task: &'a RollingTask<'a>,
    /// The meshes that exist.
    pub levels: Levels<'a>,
    /// What the motions solved so far left on them.
    pub sweep: SweepState,
    /// Which meshes suit the patches.
    pub policy: MeshPolicy,
    /// Buffers of the iterations on all levels.
    pub workspace: NewtonWorkspace,
    /// The patch as the table of creep forces has it, where that covers what is asked.
    pub(crate) covered: Option<CoveredPatch>,
    /// The ellipses that stand for the patches, where a method has asked for them.
    ellipses: OnceCell<Vec<LoadEllipse>>,
}

impl<'a> RefinementState<'a> {
    /// Before the first motion; operators come from a store.
    #[must_use]
    pub fn new(task: &'a RollingTask<'a>, store: &Arc<OperatorStore>) -> RefinementState<'a> {
        RefinementState {
            task,
            levels: Levels::new(task, store),
            sweep: SweepState::default(),
            policy: MeshPolicy::new(task.footprint),
            workspace: NewtonWorkspace::of_thread(),
            covered: CoveredPatch::of(task),
            ellipses: OnceCell::new(),
        }
    }

    /// Carries the start of a motion from the level that was solved last to another one; is there such a start?
    pub(crate) fn carry(&mut self, number: usize, motion: &Motion) -> bool {
        let Some(last) = self.sweep.last_level() else {
            return false;
        };
        let (from, to) = (self.levels.get(last), self.levels.get(number));
        let start = self.sweep.start(last, &from, &from.scale.motion(motion));
        let Some(start) = start else { return false };
        let nested = |traction| nested_tractions(&from, traction, &to);
        let three_point = nested(&start.three_point);
        let trapezoid = start.trapezoid.as_ref().map(nested);
        let trapezoid = trapezoid.unwrap_or_else(|| three_point.clone());
        let motion = to.scale.motion(motion);
        self.sweep
            .remember_rules(number, motion, three_point, trapezoid);
        true
    }

    /// Carries the tractions of the last motions on a level to another one: of all, or of all but the newest.
    pub(crate) fn carry_steps(&mut self, numbers: [usize; 2], all: bool) {
        let [from, to] = numbers.map(|number| self.levels.get(number));
        let steps = self.sweep.trapezoids(numbers[0]);
        let count = if all {
            steps.len()
        } else {
            steps.len().saturating_sub(1)
        };
        for (motion, traction) in steps.iter().take(count) {
            let motion = to.scale.motion(&from.scale.creepages(motion));
            let nested = nested_tractions(&from, traction, &to);
            let sweep = &mut self.sweep;
            sweep.remember_rules(numbers[1], motion, nested.clone(), nested);
        }
    }

    /// The ellipses that stand for the patches.
    pub fn ellipses(&self) -> &[LoadEllipse] {
        let footprint = self.task.footprint;
        let all = 0..footprint.patches().len();
        self.ellipses
            .get_or_init(|| all.map(|patch| LoadEllipse::of(footprint, patch)).collect())
    }

    /// Drops the levels that were not used for long, and what motions left on them. Called between motions: no answer may refer to a level
    /// by its number after that.
    pub fn trim(&mut self) {
        for number in self.levels.trim() {
            self.sweep.forget(number);
        }
    }
}

impl Drop for RefinementState<'_> {
    fn drop(&mut self) {
        std::mem::take(&mut self.workspace).give_back();
    }
}
