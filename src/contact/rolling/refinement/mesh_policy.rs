//! Which meshes a motion is solved on: sizes from the number of cells and the shape of the patch. Pure functions: the number of
//! refinements done so far is read from the size of the mesh.

use crate::contact::mesh::size::MeshSize;
use crate::contact::method::Method;
use crate::contact::normal::footprint::Footprint;
use crate::contact::rolling::mesh_plan::{MeshPlan, Regime};
use crate::contact::rolling::methods::fastsim;
use crate::contact::rolling::refinement::constants::{SLACK, SLACK_POLE};
use crate::contact::rolling::resolution::Resolution;

/// Cells of the first mesh of a patch that is not slender. On the first 160 ellipses of `cargo bench --bench calibrate ellipse` at the
/// targets 0.005 and 0.001, 48 takes 4 to 10 % more work and 90 takes 15 % less, with one case more or less covered.
/// On the 62 Hertz cases of the report 90 takes 7 to 66 % more time, and one case is not covered at 0.02.
pub const CELLS_FIRST: f64 = 64.0;
/// Cells of the finest mesh a target may ask for. Chosen by judgement; how much it matters was not measured.
pub const CELLS_MAX: u32 = 2048;
/// Fewest strips, and cells in one, that the rules are good for; twice as many in slender patches. Chosen by judgement; how much it matters was not
/// measured.
const SIDE_MIN: f64 = 4.0;
/// Patches longer than this many times their width, or the reverse, are slender. On the same ellipses 4 takes 17 % less work at 0.005 and
/// 15 % more at 0.001, 7 takes 12 and 7 % more; errors and coverage are alike.
const SLENDER: f64 = 5.0;
/// Coordinates of a vortex centre are rounded to multiples of this. 0.02 and 0.1 take 1 to 6 % more work on the same ellipses.
const POLE_GRID: f64 = 0.05;
/// Longest step from one mesh to the next, in half-doublings of the number of cells. With 6, motions by themselves on 400 ellipses take 1 to 8 %
/// more time at the targets .005, .002 and .001, because some starts are then too far for one rule alone.
const STEP_MAX: i32 = 4;

/// By how many half-doublings of its cells a mesh was to be finer than the first one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HalfDoublings(i32);

impl HalfDoublings {
    /// Of a mesh that was not planned as finer than another.
    pub const NONE: HalfDoublings = HalfDoublings(i32::MIN);
}

/// The meshes that suit the patches of a footprint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshPolicy {
    /// Length over width of the patch that carries most.
    a_over_b: f64,
    patches: f64,
}

impl MeshPolicy {
    /// The policy for the patches of a footprint.
    #[must_use]
    pub fn new(footprint: &Footprint) -> MeshPolicy {
        let patches = footprint.patches();
        let heaviest = patches
            .iter()
            .max_by(|a, b| a.normal_force.total_cmp(&b.normal_force));
        let a_over_b = heaviest.map_or(1.0, |p| {
            (p.extent[1] - p.extent[0]) / (p.extent[3] - p.extent[2])
        });
        MeshPolicy {
            a_over_b,
            patches: patches.len() as f64,
        }
    }

    /// The sizes that a method always takes: the mesh of the client, else the two levels of the dense method or the one of
    /// the simplified theory.
    #[must_use]
    pub fn fixed_sizes(resolution: Resolution, method: Method) -> Option<Vec<MeshSize>> {
        let size = |strips, cells| MeshSize { strips, cells };
        match (resolution, method) {
            (Resolution::Mesh(size), Method::LiuHsu | Method::Fastsim) => Some(vec![size]),
            (Resolution::Target(_), Method::LiuHsu) => Some(vec![size(6, 12), size(12, 24)]),
            (Resolution::Target(_), Method::Fastsim) => Some(vec![fastsim::MESH]),
            // The table has no mesh; nothing asks it for one.
            (_, Method::BoundaryElement | Method::Table) => None,
        }
    }

    /// How many times more slender the patch is than the meshes were made for; at least 1.
    #[must_use]
    pub fn slenderness(&self) -> f64 {
        (self.a_over_b.max(1.0 / self.a_over_b) / SLENDER).max(1.0)
    }

    fn cells_first(&self) -> f64 {
        CELLS_FIRST * self.slenderness().sqrt().min(2.0)
    }

    /// The first mesh of a motion of which nothing is known.
    #[must_use]
    pub fn first(&self) -> MeshPlan {
        self.plan(self.cells_first().round() as u32, Regime::Unknown)
    }

    /// The plan with about so many cells over all patches, an even number of strips, and a pole where the tractions turn
    /// about one. Poles lie on a grid, so that motions that differ little share their meshes.
    #[must_use]
    pub fn plan(&self, cells: u32, regime: Regime) -> MeshPlan {
        let regime = match regime {
            Regime::Spinning(pole) if self.patches == 1.0 => {
                Regime::Spinning(pole.map(|p| (p / POLE_GRID).round() * POLE_GRID))
            }
            Regime::Spinning(_) => Regime::Sticking { spinning: true },
            Regime::Unknown | Regime::Sticking { .. } => regime,
        };
        let regime = match regime {
            Regime::Sticking { spinning } => Regime::Sticking {
                spinning: spinning && self.a_over_b > 1.0,
            },
            other => other,
        };
        MeshPlan {
            size: self.size(cells, regime),
            regime,
        }
    }

    fn size(&self, cells: u32, regime: Regime) -> MeshSize {
        let cells = f64::from(cells) / self.patches;
        let shape = regime.shape(self.a_over_b);
        let least = SIDE_MIN * self.slenderness().min(2.0);
        let strips =
            (2.0 * (0.5 * (cells / shape).sqrt().max(least)).round()).min(cells.max(least));
        let along = (cells / strips).round().max(least);
        MeshSize {
            strips: strips as u32,
            cells: along as u32,
        }
    }

    /// May a mesh of so many cells, `planned` by [`MeshPolicy::next`], be refined?
    #[must_use]
    pub fn is_refinable(&self, cells: usize, planned: HalfDoublings) -> bool {
        self.half_doublings(cells).max(planned.0) < self.largest()
    }

    /// Half-doublings of the finest mesh that a target may ask for.
    fn largest(&self) -> i32 {
        (2.0 * (f64::from(CELLS_MAX) / self.cells_first()).log2() + 1e-9).floor() as i32
    }

    /// By how many half-doublings a mesh has more cells than the first one.
    fn half_doublings(&self, cells: usize) -> i32 {
        (2.0 * (cells as f64 / self.cells_first()).log2()).round() as i32
    }

    fn at(&self, half_doublings: i32, regime: Regime) -> MeshPlan {
        let cells = self.cells_first() * 2.0_f64.powf(0.5 * f64::from(half_doublings));
        self.plan(cells.round() as u32, regime)
    }

    /// The mesh after one of so many cells that is to have `excess` times as many at least, rounded to half-doublings. Motions of a sweep take
    /// coarse steps, so that they share their meshes; a motion alone may take small ones.
    ///
    /// A mesh has not quite the cells that were `planned`, because strips are even in number and may miss a patch. The next plan is finer
    /// than the last one all the same, so that refinement ends.
    #[must_use]
    pub fn next(
        &self,
        cells: usize,
        planned: HalfDoublings,
        excess: f64,
        regime: Regime,
        alone: bool,
    ) -> (MeshPlan, HalfDoublings) {
        let here = self.half_doublings(cells);
        let least = if alone { 1 } else { 2 };
        let step = ((2.0 * excess.log2()).ceil() as i32).clamp(least, STEP_MAX);
        let finer = (here + step).max(planned.0.saturating_add(1));
        let finer = finer.min(self.largest());
        (self.at(finer, regime), HalfDoublings(finer))
    }

    /// Where the next motion of a sweep should begin after a mesh whose error is `excess` times the target: on the same mesh, which
    /// keeps estimates and values continuous, until it is much finer than it need be.
    #[must_use]
    pub fn next_begin(&self, plan: MeshPlan, cells: usize, excess: Option<f64>) -> MeshPlan {
        let slack = match plan.regime {
            Regime::Spinning(_) => SLACK_POLE,
            Regime::Unknown | Regime::Sticking { .. } => SLACK,
        };
        self.coarser_if(excess.is_some_and(|excess| excess < slack), plan, cells)
    }

    /// A mesh of half as many cells as that of a plan if one is `enough`, and not coarser than the first one; else the same.
    #[must_use]
    pub fn coarser_if(&self, enough: bool, plan: MeshPlan, cells: usize) -> MeshPlan {
        let here = self.half_doublings(cells);
        if enough && here >= 2 {
            return self.at(here - 2, plan.regime);
        }
        plan
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shapes of every kind, errors just above the target, and cells as they come out of even numbers of strips, a part of which miss the
    /// patch.
    #[test]
    fn refinement_ends_whatever_the_shape_of_the_patch() {
        let ratios = (0..400).map(|k| 0.02 * 2500.0_f64.powf(f64::from(k) / 399.0));
        for (a_over_b, missed) in ratios.flat_map(|ratio| [0.0, 0.1, 0.4].map(|part| (ratio, part)))
        {
            let policy = MeshPolicy {
                a_over_b,
                patches: 1.0,
            };
            for regime in [
                Regime::Unknown,
                Regime::Sticking { spinning: true },
                Regime::Spinning([0.2, 0.1]),
            ] {
                let (mut plan, mut planned) = (policy.first(), HalfDoublings::NONE);
                let mut steps = 0;
                loop {
                    let cells = f64::from(plan.size.strips * plan.size.cells) * (1.0 - missed);
                    if !policy.is_refinable(cells as usize, planned) {
                        break;
                    }
                    (plan, planned) = policy.next(cells as usize, planned, 1.01, regime, true);
                    steps += 1;
                    assert!(steps < 20, "a/b {a_over_b}, {missed} missed: {plan:?}");
                }
            }
        }
    }
}
