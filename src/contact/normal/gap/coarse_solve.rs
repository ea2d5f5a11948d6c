//! The coarse_solution solve of a gap: one solve on a coarse grid, which takes 0.3 ms. The time of a solve is estimated from it.

use crate::contact::half_space::grid_operator::GridWorkspace;
use crate::contact::monitor::Unmonitored;
use crate::contact::normal::gap::coarse_solution::{CoarseGap, CoarsePatch};
use crate::contact::normal::gap::constants::{LEVEL_BEYOND, NEAR, RESOLUTION};
use crate::contact::normal::gap::grid::PressureGrid;
use crate::contact::normal::gap::search_box::reach_of_level;
use crate::contact::normal::gap::solve::GridStart;
use crate::contact::normal::gap::task::GapTask;

/// Boxes tried: each is larger than the one before. A product on the coarse grid takes 20 µs, and an iteration one or two of them,
/// so that the worst coarse_solution of 500 iterations in each box ends within 50 ms.
const BOXES_MAX: usize = 3;

impl GapTask {
    /// The contact on a coarse grid, solved at the first call; none if that has no answer.
    pub fn coarse_solution(&self) -> Option<&CoarseGap> {
        self.seen
            .coarse_solution
            .get_or_make(|| self.solve_coarsely())
            .as_ref()
    }

    fn solve_coarsely(&self) -> Option<CoarseGap> {
        let limits = self.gap.window();
        let mut workspace = GridWorkspace::default();
        let mut reach = self.reach();
        for _ in 0..BOXES_MAX {
            let cells = [RESOLUTION.first; 2];
            let grid = PressureGrid::new(reach.window, cells, self.gap.is_mirrored());
            let start = GridStart {
                before: None,
                reach: &reach,
                tolerance: RESOLUTION.tolerance,
            };
            let pressed = self
                .pressure_on(&grid, start, &mut workspace, &Unmonitored)
                .ok()?;
            let depth = pressed.approach - reach.least;
            if pressed.approach > reach.level {
                reach = reach_of_level(&self.gap, pressed.approach + LEVEL_BEYOND * depth);
                continue;
            }
            let area = grid.step[0] * grid.step[1];
            let patch = |cells: &Vec<usize>| {
                let extent = grid.extent_of(cells);
                CoarsePatch {
                    half: [0, 1].map(|k| 0.5 * extent[k] * grid.step[k]),
                    force: cells.iter().map(|k| pressed.pressure[*k]).sum::<f64>() * area,
                }
            };
            let mut patches: Vec<_> = grid.patches(&pressed.pressure).iter().map(patch).collect();
            patches.sort_by(|a, b| b.force.total_cmp(&a.force));
            let wanted = grid.wanted(&pressed, NEAR * depth, RESOLUTION, limits);
            return Some(CoarseGap {
                patches,
                cells_needed: wanted.needed,
            });
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::normal::gap::preview::PreviewCache;
    use crate::contact::normal::gap::surface::GapSurface;
    use crate::contact::normal::hertz::NormalLoad;

    #[test]
    fn two_bumps_are_two_patches_that_carry_the_load() {
        let y: Vec<f64> = (-120..=120).map(|k| 0.1 * f64::from(k)).collect();
        let gap = |y: &f64| ((y + 6.0).powi(2) / 300.0).min((y - 6.0).powi(2) / 100.0);
        let gap: Vec<f64> = y.iter().map(gap).collect();
        let task = GapTask {
            gap: GapSurface::profile(460.0, &y, &gap),
            loading: NormalLoad::Force(30_000.0),
            contact_modulus: 115_000.0,
            seen: PreviewCache::default(),
        };
        let Some(CoarseGap {
            patches,
            cells_needed,
        }) = task.coarse_solution()
        else {
            panic!("no coarse_solution")
        };
        assert_eq!(patches.len(), 2);
        let sum: f64 = patches.iter().map(|patch| patch.force).sum();
        assert!((sum - 30_000.0).abs() < 300.0, "{patches:?}");
        assert!(patches[0].half[1] > patches[1].half[1], "{patches:?}");
        assert!(cells_needed[1] > cells_needed[0], "{cells_needed:?}");
        assert_eq!(task, task.clone());
    }
}
