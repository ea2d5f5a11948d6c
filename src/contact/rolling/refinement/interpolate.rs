//! Prolongation: the tractions on a coarse mesh as the first iterate on a finer one.

use crate::contact::mesh::strips::{Mesh, Segment};
use crate::contact::rolling::strip_mesh::StripMesh;

/// Tractions on one mesh interpolated to another. Interpolated are their ratios to the friction bound, which vary less.
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

/// Interpolates `values` (one per coarse cell) to the cells of the fine mesh: linearly along the normalised chord,
/// linearly in y between the coarse strips of the same patch. Cells beyond the outermost strip take its value.
///
/// The result is only a first iterate: a segment without counterpart takes the values of the nearest segment of the patch.
#[must_use]
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

/// The segment of the same patch on the wanted side that is nearest in y, then in x.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::mesh::samples::mesh_between;

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
