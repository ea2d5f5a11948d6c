//! Meshes for unit tests.

use crate::contact::mesh::strips::Chord;
use crate::contact::mesh::strips::{Grading, Mesh, equal_strips};

/// A patch from y = −`half_width` to `half_width` with cosine-graded cells; `ends` returns the trailing and leading end of the chord at y.
pub(crate) fn mesh_between(
    half_width: f64,
    [strips, cells]: [usize; 2],
    ends: impl Fn(f64) -> [f64; 2],
) -> Mesh {
    let strips = equal_strips(-half_width, half_width, strips).into_iter();
    let chords: Vec<Chord> = strips
        .enumerate()
        .map(|(strip, (y, dy))| {
            let [left, right] = ends(y);
            Chord {
                patch: 0,
                strip,
                y,
                dy,
                left,
                right,
            }
        })
        .collect();
    Mesh::new(&chords, &Grading::cosine(cells))
}
