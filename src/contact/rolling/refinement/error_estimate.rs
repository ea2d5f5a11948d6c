//! The error of the resultants, estimated from the last two changes between nested meshes, and their extrapolation.

use std::f64::consts::{PI, SQRT_2};

use crate::mesh::SIDE_GOOD;
use crate::method::Method;
use crate::normal::hertz::Patch;
use crate::rolling::answer::{RelativeErrors, Resultants};
use crate::rolling::methods::fastsim;
use crate::rolling::refinement::on_mesh::DiscreteSolution;
use crate::rolling::task::{Resolution, RollingTask};

/// Safety factor on the root of the sum of squares of both changes. Chosen on 230 of the 920 ellipses, smooth grids and gaps of `benches/calibrate`: 0.9
/// covers .89 to 1.0 of the classes, 1.3 covers .95 to 1.0 for up to 1.4 times the work.
const SAFETY: f64 = 1.1;
/// Error of the resultants over the share of the load that the strips of the finest mesh cannot place. A feature narrower than a strip, such as the pressure
/// at the ends of a roller, is missed by all coarse meshes, which then agree. Chosen on 200 gaps of rollers, worn, flat-topped and kinked profiles.
const UNRESOLVED: f64 = 0.75;
/// Share of the error of the finest mesh that extrapolation removes. 0 leaves 1.3 times the error, ½ is alike.
const EXTRAPOLATED: f64 = 1.0 / 3.0;
/// Largest ratio of the numbers of cells of two meshes that are compared.
const COARSER: f64 = 0.6;

/// Least relative error on client meshes below [`SIDE_GOOD`], which may agree by chance, over the sum of the inverse squares of both numbers. From an ellipse of 6 mm × 5 mm on 3 × 3 to 8 × 8 cells with 10
/// creepages each; on other ellipses it also covers 3 to 5 strips of 40 cells, 24 strips of 3 and 40 strips of 4.
const ERROR_FEW: f64 = 0.3;
/// Meshes with fewer strips or cells cannot be compared with a coarser one. Their least relative error is the inverse square of that number.
const SIDE_FEW: u32 = 3;
/// Error of the resultants due to region and pressure of a gap with one cell of the normal problem across a patch (100 gaps and 96 patches of wheels on
/// rails with about 44 cells).
const REGION: f64 = 0.45;
/// Power of the number of cells with which that error falls.
const REGION_POWER: f64 = 1.75;

/// The error of a number that is extrapolated like the resultants, from its value on the finest mesh, if both changes between meshes are equal.
pub(crate) fn error_by_extrapolation(extrapolated: f64, finest: f64) -> f64 {
    SAFETY * SQRT_2 / EXTRAPOLATED * (extrapolated - finest).abs()
}

/// Resultants with their relative errors.
#[derive(Debug, Clone)]
pub(crate) struct Estimate {
    /// Resultants of every patch, extrapolated on request.
    pub(crate) resultants: Vec<Resultants>,
    /// Relative errors, patch by patch, then of the sum; `None` without a coarser mesh.
    pub(crate) errors: RelativeErrors,
}

impl Estimate {
    /// Raises the errors to at least the distances from other resultants.
    pub(crate) fn cover(&mut self, task: &RollingTask, other: &[Resultants]) {
        let patches = task.footprint.patches();
        let apart = distances(task, patches, &self.resultants, other);
        for (error, apart) in self.errors.iter_mut().flatten().zip(apart) {
            *error = error.max(apart);
        }
    }

    /// The error of the sum over the patches.
    pub(crate) fn whole(&self) -> Option<f64> {
        self.errors.last().copied().flatten()
    }

    /// The estimate from meshes of one motion, coarse to fine; `None` without a mesh. Values are those of the finest mesh, extrapolated on request.
    pub(crate) fn of(
        task: &RollingTask,
        index: usize,
        solved: &[DiscreteSolution],
        extrapolates: bool,
    ) -> Option<Estimate> {
        let patches = task.footprint.patches();
        let finest = solved.last()?;
        let mut found = Estimate {
            resultants: finest.resultants.clone(),
            errors: vec![None; patches.len() + 1],
        };
        if finest.tangential.is_without_traction() {
            found.errors.fill(Some(0.0));
            return Some(found);
        }
        if task.method == Method::Fastsim {
            // No mesh shows what the theory leaves out.
            let error = fastsim::stated_error(finest.mesh.plan.size);
            found.errors.fill(Some(error));
            return Some(found);
        }
        let size = finest.mesh.plan.size;
        let side = size.cells.min(size.strips);
        let alone = f64::from(side).powi(-2);
        let Some(middle) = coarser(solved, solved.len() - 1) else {
            if side < SIDE_FEW {
                found.errors.fill(Some(alone));
            }
            return Some(found);
        };
        // The power of the number of cells with which the error falls. A layer between the bodies lowers the order at the leading edge (60 ellipses with a layer).
        let order = if task.interface.layer > 0.0 { 0.5 } else { 1.0 };
        // The ratio of the errors of the coarser and the finer of two meshes.
        let ratio = |fine: usize, coarse: usize| {
            (solved[fine].cells() / solved[coarse].cells()).powf(order)
        };
        let change = |fine: usize, coarse: usize| {
            let [here, there] = [fine, coarse].map(|k| &*solved[k].resultants);
            let scale = 1.0 / (ratio(fine, coarse) - 1.0);
            let mut apart = distances(task, patches, here, there);
            apart.iter_mut().for_each(|d| *d *= scale);
            apart
        };
        let last = solved.len() - 1;
        let one = change(last, middle);
        let two = match coarser(solved, middle) {
            Some(first) => {
                let mut two = change(middle, first);
                let left = 1.0 / ratio(last, middle);
                two.iter_mut().for_each(|d| *d *= left);
                two
            }
            None => one.clone(),
        };
        let given = matches!(task.resolution, Resolution::Mesh(_));
        let inverse_squares = || [size.strips, size.cells].map(|n| f64::from(n).powi(-2));
        let least = match given {
            true if side < SIDE_FEW => alone,
            true if side < SIDE_GOOD => ERROR_FEW * inverse_squares().iter().sum::<f64>(),
            _ => task.tolerance(index),
        };
        let normal = normal_errors(task, patches);
        let unresolved = unresolved(patches, &finest.mesh.unresolved);
        for (k, error) in found.errors.iter_mut().enumerate() {
            let changes = SAFETY * one[k].hypot(two[k]);
            let parts = [unresolved[k], normal[k], least];
            *error = Some(parts.into_iter().fold(changes, f64::hypot));
        }
        if extrapolates {
            let share = EXTRAPOLATED / (ratio(last, middle) - 1.0);
            let coarse = &solved[middle].resultants;
            for (k, value) in found.resultants.iter_mut().enumerate() {
                // Where friction varies across, the sum of the loads of the strips differs slightly from the limit.
                let limit = task.friction.limit(task.footprint, k);
                let bound = limit.max(value.force_x.hypot(value.force_y));
                *value = value.beyond(coarse[k], share, bound);
            }
        }
        Some(found)
    }
}

/// The finest of the meshes before `fine` that is coarse enough to be compared with it.
pub(crate) fn coarser(solved: &[DiscreteSolution], fine: usize) -> Option<usize> {
    let most = COARSER * solved[fine].cells();
    solved[..fine].iter().rposition(|mesh| mesh.cells() <= most)
}

/// Distances of two sets of resultants in their largest component: for every patch relative to its own μN, with moments about its middle, then for the sums.
pub(crate) fn distances(
    task: &RollingTask,
    patches: &[Patch],
    found: &[Resultants],
    other: &[Resultants],
) -> Vec<f64> {
    let mut distances = Vec::with_capacity(patches.len() + 1);
    let (mut sum, mut sum_other) = (Resultants::default(), Resultants::default());
    let (mut force, mut area, mut centre) = (0.0, 0.0, [0.0, 0.0]);
    for (k, ((patch, found), other)) in patches.iter().zip(found).zip(other).enumerate() {
        let bound = task.friction.limit(task.footprint, k);
        let at = [
            0.5 * (patch.extent[0] + patch.extent[1]),
            0.5 * (patch.extent[2] + patch.extent[3]),
        ];
        let length = (patch.area / PI).sqrt();
        distances.push(found.about(at).distance(&other.about(at), bound, length));
        sum = sum.plus(*found);
        sum_other = sum_other.plus(*other);
        force += bound;
        area += patch.area;
        centre = [centre[0] + bound * at[0], centre[1] + bound * at[1]];
    }
    let centre = centre.map(|c| c / force);
    let length = (area / PI).sqrt();
    distances.push(
        sum.about(centre)
            .distance(&sum_other.about(centre), force, length),
    );
    distances
}

/// Relative errors due to loads that the strips cannot place, patch by patch, then for the sum.
fn unresolved(patches: &[Patch], shares: &[f64]) -> Vec<f64> {
    let mut errors: Vec<f64> = shares.iter().map(|share| UNRESOLVED * share).collect();
    errors.push(load_weighted(patches, &errors));
    errors
}

/// The mean of the errors of the patches, weighted by their loads.
fn load_weighted(patches: &[Patch], errors: &[f64]) -> f64 {
    let load: f64 = patches.iter().map(|patch| patch.normal_force).sum();
    let pairs = errors.iter().zip(patches);
    pairs
        .map(|(error, patch)| error * patch.normal_force / load)
        .sum()
}

/// Relative errors due to region, pressure and load of a computed normal problem, patch by patch, then for the sum.
fn normal_errors(task: &RollingTask, patches: &[Patch]) -> Vec<f64> {
    let Some(uncertainty) = task.footprint.uncertainty() else {
        return vec![0.0; patches.len() + 1];
    };
    let of = |cells: &f64| REGION * cells.max(1.0).powf(-REGION_POWER);
    let mut errors: Vec<f64> = uncertainty.cells_across.iter().map(of).collect();
    // An error of the deepest patch, or a distance between surfaces that should touch, shifts the surface at the other patches by a part of the largest depth.
    // The load of a patch grows with the power 3/2 of its own depth.
    let depth = |patch: &Patch| patch.normal_force / patch.area.sqrt();
    let deepest =
        (0..patches.len()).max_by(|a, b| depth(&patches[*a]).total_cmp(&depth(&patches[*b])));
    if let Some(deepest) = deepest {
        let shift = errors[deepest].hypot(uncertainty.distance) * depth(&patches[deepest]);
        for k in (0..patches.len()).filter(|k| *k != deepest) {
            errors[k] = errors[k].hypot(1.5 * shift / depth(&patches[k]));
        }
    }
    errors
        .iter_mut()
        .for_each(|error| *error = error.hypot(uncertainty.load));
    errors.push(load_weighted(patches, &errors));
    errors
}
