//! The solution of a gap: a pressure field from the last grids, and remarks.

use crate::normal::gap::grid::{
    CELLS_ACROSS_MIN, GapOutcome, NormalAnswer, NormalError, NormalWork, PatchGrid, SHARE_MIN,
    squares,
};
use crate::normal::gap::task::GapTask;
use crate::normal::pressure_field::field::PressureField;
use crate::normal::pressure_field::grid_pressure::GridPressure;
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;

/// Ratio of a half-width of a patch to the radius in its direction above which half-spaces are poor approximations of the bodies. Chosen by judgement.
pub(crate) const HALF_WIDTH_USUAL_MAX: f64 = 0.3;
/// Ratio of the approach to the smaller half-width above which strains are too large for linear elasticity. Chosen by judgement.
pub(crate) const APPROACH_USUAL_MAX: f64 = 0.15;

/// An unresolved patch.
struct Coarse {
    /// Middle `[x, y]` of the patch in mm.
    middle: [f64; 2],
    /// Number of cells on the shorter chord through its middle.
    cells: f64,
    /// Its part of the load.
    share: f64,
}

impl GapTask {
    /// The field, report and remarks of a solution.
    pub(crate) fn found(&self, outcome: GapOutcome) -> Result<NormalAnswer, NormalError> {
        let loads = outcome.patch_grids.iter().map(PatchGrid::load);
        let heaviest = loads
            .zip(&outcome.patch_grids)
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, patch_grid)| patch_grid);
        let Some(PatchGrid { grid, pressed }) = heaviest else {
            unreachable!("at least one grid is tried")
        };
        let report = NormalWork {
            cells: grid.cells,
            grids: outcome.patch_grids.len(),
            iterations: outcome.iterations,
            residual: pressed.residual,
            pressure_change: outcome.pressure_change,
        };
        let field = field(&outcome.patch_grids).map_err(NormalError::NoAnswer)?;
        let coarse = coarse(&outcome.patch_grids);
        let mut remarks = Vec::new();
        for Coarse {
            middle,
            cells,
            share,
        } in &coarse
        {
            let remark = Remark::PatchCoarse {
                cells_across: *cells,
                load_share: *share,
            };
            remarks.push(match field.patch_at(*middle) {
                Some(patch) => remark.at_patch(patch),
                None => remark.into(),
            });
        }
        if !outcome.settled && coarse.is_empty() {
            remarks.push(Remark::GapRough {}.into());
        }
        remarks.extend(self.remarks(&field, pressed.approach - outcome.least));
        Ok(NormalAnswer {
            field,
            report,
            remarks,
        })
    }

    /// Remarks on contacts for which half-spaces are poor approximations, from the patch with the largest load.
    fn remarks(&self, field: &PressureField, depth: f64) -> Vec<RemarkEntry> {
        let patches = field.patches();
        let heaviest = patches
            .iter()
            .enumerate()
            .max_by(|(_, a), (_, b)| a.normal_force.total_cmp(&b.normal_force));
        let Some((patch, extent)) = heaviest.map(|(k, patch)| (k, patch.extent)) else {
            return Vec::new();
        };
        let [x_min, x_max, y_min, y_max] = extent;
        let (a, b) = (0.5 * (x_max - x_min), 0.5 * (y_max - y_min));
        let mut remarks = Vec::new();
        if let Some(rolling) = self.gap.rolling_radius()
            && a > HALF_WIDTH_USUAL_MAX * rolling
        {
            let remark = Remark::NearlyConformal {
                length_mm: 2.0 * a,
                rolling_radius_mm: rolling,
            };
            remarks.push(remark.at_patch(patch));
        }
        if depth > APPROACH_USUAL_MAX * a.min(b) {
            let remark = Remark::StrainsTooLarge {
                overlap_mm: depth,
                half_width_mm: a.min(b),
            };
            remarks.push(remark.at_patch(patch));
        }
        remarks
    }
}

/// Unresolved patches that should be resolved, by descending load.
fn coarse(patch_grids: &[PatchGrid]) -> Vec<Coarse> {
    let total: f64 = patch_grids.iter().map(PatchGrid::load).sum();
    let mut found = Vec::new();
    for PatchGrid { grid, pressed } in patch_grids {
        let area = grid.step[0] * grid.step[1];
        for patch in grid.patches(&pressed.pressure) {
            let load: f64 = patch.iter().map(|k| pressed.pressure[*k]).sum();
            let share = load * area / total;
            let [along, across] = grid.chords_of(&patch);
            let cells = along.min(across);
            if share >= SHARE_MIN && cells < CELLS_ACROSS_MIN {
                let middle = grid.window_of(&patch).map(|[low, high]| 0.5 * (low + high));
                found.push(Coarse {
                    middle,
                    cells,
                    share,
                });
            }
        }
    }
    found.sort_by(|a, b| b.share.total_cmp(&a.share));
    found
}

/// The pressures of the grids as a field with edges between their cells.
fn field(patch_grids: &[PatchGrid]) -> Result<PressureField, String> {
    let loaded = patch_grids
        .iter()
        .filter(|patch_grid| patch_grid.largest() > 0.0);
    let grids = loaded.map(|PatchGrid { grid, pressed }| {
        GridPressure::of_solution(
            &grid.centres(0),
            &grid.centres(1),
            &squares(grid.cells[0], &pressed.pressure),
            &pressed.pressure,
            pressed.approach,
        )
    });
    PressureField::of_grids(grids.collect::<Result<_, _>>()?)
}
