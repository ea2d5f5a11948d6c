//! Where the displacements of a strip are observed.

use crate::contact::mesh::strips::{Mesh, Segment};

/// The observation points of a segment: its nodes, its leading edge, and the images of its last two nodes behind that edge.
#[must_use]
pub fn observation_points(mesh: &Mesh, segment: &Segment) -> Vec<f64> {
    let mut points = Vec::with_capacity(segment.cells.len() + 3);
    observe(mesh, segment, &mut points);
    points
}

/// The same in place of what `points` held.
pub fn observe(mesh: &Mesh, segment: &Segment, points: &mut Vec<f64>) {
    let nodes = &mesh.node[segment.cells.clone()];
    let edge = segment.chord.right;
    let n = nodes.len();
    let last = nodes[n - 1];
    let before = if n > 1 {
        nodes[n - 2]
    } else {
        segment.chord.left
    };
    points.clear();
    points.extend_from_slice(nodes);
    points.extend([edge, 2.0 * edge - last, 2.0 * edge - before]);
}
