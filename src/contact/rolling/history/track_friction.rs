//! Friction that lies still on the track while the patch passes over it: bounds of the cells by the distance rolled.

use crate::contact::friction::along::AlongLaw;
use crate::contact::mesh::strips::Mesh;

/// What the bounds of the cells are taken from.
pub(super) struct TrackFriction {
    law: AlongLaw,
    /// Trailing and leading edge of each cell with unknowns in mm, when nothing has been rolled over.
    cells: Vec<[f64; 2]>,
    /// Bounds with the largest coefficient.
    largest: Vec<f64>,
}

impl TrackFriction {
    /// The friction of a track under the first cells of a mesh in mm, as many as have unknowns, which would have these bounds with the
    /// largest coefficient everywhere.
    pub(super) fn new(law: &AlongLaw, mesh: &Mesh, cells: usize, largest: &[f64]) -> TrackFriction {
        let edges = mesh.left.iter().zip(&mesh.right).take(cells);
        TrackFriction {
            law: law.clone(),
            cells: edges.map(|(left, right)| [*left, *right]).collect(),
            largest: largest.to_vec(),
        }
    }

    /// Sets the bounds to those of the coefficients under the cells after so many mm; rolling goes towards larger x.
    pub(super) fn lay(&self, travelled: f64, bounds: &mut [f64]) {
        let most = self.law.largest();
        let cells = self.cells.iter().zip(&self.largest);
        for (bound, ([left, right], largest)) in bounds.iter_mut().zip(cells) {
            let mean = self.law.mean(left + travelled, right + travelled);
            *bound = largest * (mean / most);
        }
    }
}
