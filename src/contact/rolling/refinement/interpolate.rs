//! State kept from one motion of a footprint to the next: meshes, predictor and buffers; and the prolongation of tractions to a finer mesh.

use std::cell::OnceCell;
use std::sync::Arc;

use crate::error::SolveError;
use crate::mesh::{Mesh, Segment};
use crate::rolling::load_ellipse::LoadEllipse;
use crate::rolling::methods::boundary_element::workspace::NewtonWorkspace;
use crate::rolling::operator_store::{CaseOperators, OperatorStore};
use crate::rolling::refinement::predictor::Predictor;
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::{MeshPlan, RollingTask};

/// Prolongs tractions from one mesh to another. Their ratios to the friction bound are interpolated, because these vary less.
pub(crate) fn prolonged(
    from: &StripMesh,
    traction: &[Vec<f64>; 2],
    to: &StripMesh,
) -> [Vec<f64>; 2] {
    [0, 1].map(|k| {
        let pairs = traction[k].iter().zip(&from.bound);
        let relative: Vec<f64> = pairs
            .map(|(t, g)| if *g > 0.0 { t / g } else { 0.0 })
            .collect();
        let mut values = interpolate(&from.mesh, &relative, &to.mesh);
        values.iter_mut().zip(&to.bound).for_each(|(t, g)| *t *= g);
        values
    })
}

/// Interpolates `values` (one per coarse cell) to the cells of the fine mesh: linearly along the normalised chord and linearly in y between the coarse strips
/// of the same patch. Cells beyond the outermost strip take its value.
pub fn interpolate(coarse: &Mesh, values: &[f64], fine: &Mesh) -> Vec<f64> {
    let mut out = vec![0.0; fine.cells()];
    for segment in &fine.segments {
        let below = nearest(coarse, segment, |y| y <= segment.chord.y);
        let above = nearest(coarse, segment, |y| y > segment.chord.y);
        let (first, second) = match (below, above) {
            (Some(a), Some(b)) => (a, b),
            (Some(a), None) | (None, Some(a)) => (a, a),
            (None, None) => continue,
        };
        let gap = second.chord.y - first.chord.y;
        let weight = if gap > 0.0 {
            (segment.chord.y - first.chord.y) / gap
        } else {
            0.0
        };
        for i in segment.cells.clone() {
            let place =
                (fine.node[i] - segment.chord.left) / (segment.chord.right - segment.chord.left);
            let at = |s: &Segment| along(coarse, s, values, place);
            out[i] = (1.0 - weight) * at(first) + weight * at(second);
        }
    }
    out
}

/// The segment of the same patch on the given side that is nearest in y, then in x.
fn nearest<'a>(
    mesh: &'a Mesh,
    segment: &Segment,
    side: impl Fn(f64) -> bool,
) -> Option<&'a Segment> {
    let middle = |s: &Segment| 0.5 * (s.chord.left + s.chord.right);
    let distance = |s: &Segment| {
        (
            (s.chord.y - segment.chord.y).abs(),
            (middle(s) - middle(segment)).abs(),
        )
    };
    mesh.segments
        .iter()
        .filter(|s| s.chord.patch == segment.chord.patch && side(s.chord.y))
        .min_by(|a, b| {
            distance(a)
                .partial_cmp(&distance(b))
                .unwrap_or(std::cmp::Ordering::Equal)
        })
}

/// Value at the relative position `place` (0 to 1) of a segment, linear between nodes.
fn along(mesh: &Mesh, segment: &Segment, values: &[f64], place: f64) -> f64 {
    let x = segment.chord.left + place * (segment.chord.right - segment.chord.left);
    let nodes = &mesh.node[segment.cells.clone()];
    let values = &values[segment.cells.clone()];
    let next = nodes.partition_point(|node| *node <= x);
    if next == 0 {
        return values[0];
    }
    if next == nodes.len() {
        return values[nodes.len() - 1];
    }
    let weight = (x - nodes[next - 1]) / (nodes[next] - nodes[next - 1]);
    (1.0 - weight) * values[next - 1] + weight * values[next]
}

/// Number of meshes kept from one motion to the next, enough for a few families. Sweeps return only to the meshes of the last few motions; in a creep map of
/// 900 motions at fixed spin, half as many make no difference (`cargo bench --bench stress -- --only creep-map`).
pub const LEVELS_KEPT: usize = 32;

/// The meshes of a case; the least recently used are dropped between motions.
#[derive(Debug)]
pub struct Levels<'a> {
    task: &'a RollingTask<'a>,
    operators: Arc<CaseOperators>,
    /// Meshes with their unique numbers, in the order of their last use.
    kept: Vec<(usize, Arc<StripMesh>)>,
    made: usize,
}

impl<'a> Levels<'a> {
    /// Starts without meshes; their operators come from a store.
    pub fn new(task: &'a RollingTask<'a>, store: &Arc<OperatorStore>) -> Levels<'a> {
        Levels {
            task,
            operators: CaseOperators::new(store),
            kept: Vec::new(),
            made: 0,
        }
    }

    /// The number of the mesh of this plan, which is made if it is missing.
    ///
    /// # Errors
    /// If no strip meets a patch.
    pub fn level(&mut self, plan: MeshPlan) -> Result<usize, SolveError> {
        if let Some(place) = self.kept.iter().position(|(_, level)| level.plan == plan) {
            // The most recently used mesh is the last one.
            self.kept[place..].rotate_left(1);
            return Ok(self.kept[self.kept.len() - 1].0);
        }
        let operators = Arc::clone(&self.operators);
        let level = StripMesh::with_operators(self.task, plan, operators)?;
        self.kept.push((self.made, Arc::new(level)));
        self.made += 1;
        Ok(self.made - 1)
    }

    /// The mesh with a number; it must have been used since the last [`Levels::trim`].
    pub fn get(&self, level: usize) -> Arc<StripMesh> {
        let found = self.kept.iter().rev().find(|(number, _)| *number == level);
        let Some((_, level)) = found else {
            unreachable!("level {level} was dropped while it was in use")
        };
        Arc::clone(level)
    }

    /// Drops the least recently used meshes beyond [`LEVELS_KEPT`] and returns their numbers. Called between motions, when no solution refers to a mesh by its
    /// number.
    pub fn trim(&mut self) -> Vec<usize> {
        let surplus = self.kept.len().saturating_sub(LEVELS_KEPT);
        let dropped = self.kept.drain(..surplus);
        dropped.map(|(number, _)| number).collect()
    }
}

/// The state of the refinement of one footprint. It saves time and changes no mesh and no estimate.
#[derive(Debug)]
pub struct RefinementState<'a> {
    task: &'a RollingTask<'a>,
    /// The meshes.
    pub levels: Levels<'a>,
    /// Tractions of recent motions.
    pub predictor: Predictor,
    /// Buffers of the iterations on all meshes.
    pub workspace: NewtonWorkspace,
    /// Equivalent ellipses of the patches.
    ellipses: OnceCell<Vec<LoadEllipse>>,
}

impl<'a> RefinementState<'a> {
    /// The state before the first motion; operators come from a store.
    pub fn new(task: &'a RollingTask<'a>, store: &Arc<OperatorStore>) -> RefinementState<'a> {
        RefinementState {
            task,
            levels: Levels::new(task, store),
            predictor: Predictor::default(),
            workspace: NewtonWorkspace::default(),
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

    /// Drops the least recently used meshes and the tractions on them. Called between motions, when no solution refers to a mesh by its number.
    pub fn trim(&mut self) {
        for number in self.levels.trim() {
            self.predictor.forget(number);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::mesh_between;

    fn square(strips: usize, cells: usize) -> Mesh {
        mesh_between(1.0, [strips, cells], |_| [-1.0, 1.0])
    }

    #[test]
    fn linear_functions_are_reproduced_between_nodes() {
        let (coarse, fine) = (square(6, 8), square(9, 16));
        let function = |x: f64, y: f64| 1.0 + 2.0 * x - 3.0 * y;
        let values: Vec<f64> = coarse
            .node
            .iter()
            .zip(coarse.cell_load_y())
            .map(|(x, y)| function(*x, y))
            .collect();
        let found = interpolate(&coarse, &values, &fine);
        for (i, (x, y)) in fine.node.iter().zip(fine.cell_load_y()).enumerate() {
            let inside = x.abs() <= coarse.node[7] && y.abs() <= coarse.segments[5].chord.y;
            assert!(
                !inside || (found[i] - function(*x, y)).abs() < 1e-12,
                "{x} {y} {}",
                found[i]
            );
        }
    }
}
