//! Where the displacements of a strip are observed.

use crate::contact::mesh::strips::{Mesh, Segment};

/// The observation points of a segment, see the module's text.
#[must_use]
pub fn observation_points(mesh: &Mesh, segment: &Segment) -> Vec<f64> {
    let nodes = &mesh.node[segment.cells.clone()];
    let edge = segment.chord.right;
    let n = nodes.len();
    let last = nodes[n - 1];
    let before = if n > 1 {
        nodes[n - 2]
    } else {
        segment.chord.left
    };
    let mut points = nodes.to_vec();
    points.extend([edge, 2.0 * edge - last, 2.0 * edge - before]);
    points
}
