//! The slip of an elastic layer between the bodies: the derivative along x of flexibility times traction.
//!
//! Each point of a thin layer shears by itself (Winkler), and outside the contact by nothing. So the differences that the rules work on
//! are those of neighbouring tractions of a strip, with a traction of 0 at its leading edge and none beyond it; the mirror images that
//! continue the displacements of the bodies there have no part in it.

use std::ops::Range;

use crate::contact::mesh::strips::{Mesh, Segment};
use crate::contact::rolling::slip_rules::{Rule, Stencils};

/// The layer on the segments of a mesh under one rule.
#[derive(Debug)]
pub(crate) struct LayerSlip {
    /// Dimensionless: displacement over traction.
    flexibility: f64,
    stencils: Stencils,
}

impl LayerSlip {
    pub(crate) fn new(
        rule: Rule,
        mesh: &Mesh,
        segments: &[Segment],
        flexibility: f64,
    ) -> LayerSlip {
        LayerSlip {
            flexibility,
            stencils: Stencils::ending_at_the_edge(rule, mesh, segments),
        }
    }

    /// Adds the slip of the tractions of a segment to those of the whole mesh.
    pub(crate) fn add(
        &self,
        cells: Range<usize>,
        traction: &[f64],
        slip: &mut [f64],
        [differences, own]: &mut [Vec<f64>; 2],
    ) {
        let n = traction.len();
        differences.clear();
        differences.extend(
            traction
                .windows(2)
                .map(|t| self.flexibility * (t[1] - t[0])),
        );
        differences.push(-self.flexibility * traction[n - 1]);
        differences.resize(n + 2, 0.0);
        own.resize(n, 0.0);
        self.stencils.elastic(cells.clone(), differences, own);
        for (slip, own) in slip[cells].iter_mut().zip(&own[..n]) {
            *slip += own;
        }
    }

    /// Adds the slips of a unit traction on one cell of a segment, along x and across.
    pub(crate) fn add_column(&self, cells: Range<usize>, cell: usize, slips: [&mut [f64]; 2]) {
        let n = cells.len();
        let mut unit = vec![0.0; n];
        unit[cell] = 1.0;
        let (mut slip, mut buffers) = (vec![0.0; cells.end], [Vec::new(), Vec::new()]);
        self.add(cells.clone(), &unit, &mut slip, &mut buffers);
        for slips in slips {
            for (to, from) in slips.iter_mut().zip(&slip[cells.clone()]) {
                *to += from;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::mesh::chord::Chord;
    use crate::contact::mesh::strips::Grading;

    /// A layer alone, in full stick: `w + L dT/dx = 0` gives tractions that grow from the leading edge, as in Kalker's simplified theory.
    #[test]
    fn tractions_that_grow_evenly_from_the_leading_edge_slip_evenly() {
        let chord = Chord {
            patch: 0,
            strip: 0,
            y: 0.0,
            dy: 1.0,
            left: -2.0,
            right: 1.0,
        };
        for rule in [Rule::Upwind, Rule::ThreePoint, Rule::Trapezoid] {
            for n in [1, 2, 3, 8] {
                let mesh = Mesh::new(&[chord], &Grading::cosine(n));
                let layer = LayerSlip::new(rule, &mesh, &mesh.segments, 0.4);
                let traction: Vec<f64> = mesh.node.iter().map(|x| 0.7 * (1.0 - x)).collect();
                let mut slip = vec![0.0; n];
                layer.add(0..n, &traction, &mut slip, &mut Default::default());
                for slip in slip {
                    assert!((slip + 0.28).abs() < 1e-12, "{rule:?} {n}: {slip}");
                }
            }
        }
    }
}
