//! Which displacements in a step give the forces that were asked for? Newton's iteration with Broyden's update of the stiffness, which is
//! kept from step to step.

/// Trials in one step. A few are usual.
const TRIALS_MAX: u32 = 40;
/// Longest step of a component, in units of what its stiffness asks for at the friction limit.
const STRIDE_MAX: f64 = 1.5;

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FoundStep {
    /// The components.
    pub(crate) place: [f64; 2],
    /// How far the forces are from those asked for, relative to the friction limit.
    pub(crate) off: f64,
}

/// The search for the components that are prescribed by forces.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StepSearch {
    /// Which components are searched.
    pub(crate) searched: [bool; 2],
    /// Change of the components per change of the forces over the friction limit.
    pub(crate) compliance: [[f64; 2]; 2],
    /// Largest change of a component in one trial.
    stride: [f64; 2],
}

impl StepSearch {
    /// A search with a compliance to begin with.
    pub(crate) fn new(searched: [bool; 2], compliance: [f64; 2]) -> StepSearch {
        StepSearch {
            searched,
            compliance: [[compliance[0], 0.0], [0.0, compliance[1]]],
            stride: compliance.map(|c| STRIDE_MAX * c.abs()),
        }
    }

    /// Finds where `off` is below `tolerance`; `off` gives the forces less those asked for.
    pub(crate) fn find<E>(
        &mut self,
        start: [f64; 2],
        tolerance: f64,
        mut off: impl FnMut([f64; 2]) -> Result<[f64; 2], E>,
    ) -> Result<FoundStep, E> {
        let searched = self.searched;
        let masked = |values: [f64; 2]| [0, 1].map(|k| if searched[k] { values[k] } else { 0.0 });
        let mut place = start;
        let mut residual = masked(off(place)?);
        let mut best = (length(residual), place);
        let initial = self.compliance;
        for trial in 0..TRIALS_MAX {
            if best.0 <= tolerance {
                break;
            }
            let mut step = masked([0, 1].map(|i| {
                let row = self.compliance[i];
                let wanted = -(row[0] * residual[0] + row[1] * residual[1]);
                wanted.clamp(-self.stride[i], self.stride[i])
            }));
            if trial > 12 {
                // Smaller steps from the best place.
                place = best.1;
                residual = masked(off(place)?);
                step = step.map(|s| s * 0.5_f64.powi(trial as i32 / 6 - 1));
            }
            let next = [0, 1].map(|k| place[k] + step[k]);
            let found = masked(off(next)?);
            let change = [found[0] - residual[0], found[1] - residual[1]];
            self.update(step, change, initial);
            (place, residual) = (next, found);
            if length(residual) < best.0 {
                best = (length(residual), place);
            }
        }
        if length(residual) > best.0 {
            residual = masked(off(best.1)?);
        }
        Ok(FoundStep {
            place: best.1,
            off: length(residual),
        })
    }

    /// Broyden's update of the compliance; one that loses its sign or its size is taken back.
    fn update(&mut self, step: [f64; 2], change: [f64; 2], initial: [[f64; 2]; 2]) {
        let moved = self.compliance.map(|[a, b]| a * change[0] + b * change[1]);
        let denominator = step[0] * moved[0] + step[1] * moved[1];
        let size = step[0] * step[0] + step[1] * step[1];
        if denominator.abs() <= 1e-3 * size {
            return;
        }
        let row = [0, 1].map(|j| step[0] * self.compliance[0][j] + step[1] * self.compliance[1][j]);
        for i in 0..2 {
            for (entry, row) in self.compliance[i].iter_mut().zip(row) {
                *entry += (step[i] - moved[i]) * row / denominator;
            }
        }
        for k in 0..2 {
            if self.searched[k] && self.compliance[k][k] <= 1e-3 * initial[k][k] {
                self.compliance = initial;
                return;
            }
        }
    }
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}
