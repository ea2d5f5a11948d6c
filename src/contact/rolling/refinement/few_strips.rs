//! Loads that lie on few strips.

use crate::contact::rolling::refinement::constants::STRIPS_FEW;
use crate::contact::rolling::strip_mesh::StripMesh;

/// A factor for a patch whose load lies on few of its strips.
pub(super) fn few_strips(level: &StripMesh) -> f64 {
    let mut loads: Vec<(usize, usize, f64)> = Vec::new();
    for segment in &level.mesh.segments {
        let load = |i: usize| level.pressure[i] * level.area[i];
        let load: f64 = segment.cells.clone().map(load).sum();
        let (patch, strip) = (segment.chord.patch, segment.chord.strip);
        match loads.last_mut() {
            Some(last) if (last.0, last.1) == (patch, strip) => last.2 += load,
            _ => loads.push((patch, strip, load)),
        }
    }
    let counted = |patch: &[(usize, usize, f64)]| {
        let sum = |power: i32| patch.iter().map(|(.., load)| load.powi(power)).sum::<f64>();
        let (load, squares) = (sum(1), sum(2));
        if squares > 0.0 {
            load * load / squares
        } else {
            STRIPS_FEW
        }
    };
    let fewest = loads
        .chunk_by(|a, b| a.0 == b.0)
        .map(counted)
        .fold(STRIPS_FEW, f64::min);
    (STRIPS_FEW / fewest).powi(2)
}
