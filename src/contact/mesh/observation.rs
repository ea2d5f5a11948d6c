//! The points of a strip at which displacements are evaluated.

use crate::contact::mesh::strips::{Mesh, Segment};

/// The observation points of a segment: its nodes, its leading edge, and its last two nodes reflected in that edge.
#[must_use]
pub fn observation_points(mesh: &Mesh, segment: &Segment) -> Vec<f64> {
    let mut points = Vec::with_capacity(segment.cells.len() + 3);
    observe(mesh, segment, &mut points);
    points
}

/// As [`observation_points`], but written into `points`, whose contents are replaced.
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
    points.reserve(n + 3);
    points.extend_from_slice(nodes);
    points.extend([edge, 2.0 * edge - last, 2.0 * edge - before]);
}
