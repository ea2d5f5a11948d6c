//! The discrete equations of all tangential methods: `s = q + M T` with `|T| ≤ g` on every cell.
//!
//! Everything is dimensionless: lengths by the scale of the patch, tractions by a reference traction P, slips by P/G.
//! Vectors hold all x components, then all y components, each padded with zeros to the operator's length.

use std::ops::Range;

use crate::half_space::strip_operator::kind::Parity;
use crate::half_space::strip_operator::operator::{OperatorScratch, StripOperator, rows_of};
use crate::mesh::{Mesh, Segment};
use crate::monitor::{Monitor, Stop};
use crate::rolling::displacement_memory::DisplacementMemory;
use crate::rolling::slip_rules::{Rule, Stencils};
use crate::rolling::task::Motion;

/// A rule on a mesh with its operator: the linear map from tractions to slips.
#[derive(Debug)]
pub struct SlipEquations<'a> {
    /// The rule in use.
    pub rule: Rule,
    differences: &'a StripOperator,
    parity: Option<Parity>,
    stencils: Stencils,
    /// The slip of an elastic layer between the bodies, if there is one.
    layer: Option<LayerSlip>,
    flexibility: f64,
    /// The slip from the change of displacements in time, if rolling is not steady.
    memory: Option<DisplacementMemory<'a>>,
    /// Cells and rows of every segment that has unknowns.
    cells: Vec<Range<usize>>,
    rows: Vec<Range<usize>>,
    padded: usize,
    row_count: usize,
    /// y of the rigid slip of every segment.
    y: Vec<f64>,
}

/// Mean slip of every cell that neither the motion nor the tractions cause, in the units of the motion, for example by the pressure of dissimilar bodies.
/// Every rule adds it to the slip of the cell itself: sampling it like rigid slip would propagate the error at the leading edge along the strip under the
/// trapezoid rule.
#[derive(Debug, Clone, Copy)]
pub struct SlipSource<'a> {
    /// Along x.
    pub x: &'a [f64],
    /// Across.
    pub y: &'a [f64],
}

/// Buffers of products with equations of any size. The caller keeps them, so that a product allocates nothing and threads can share the equations.
#[derive(Debug, Clone, Default)]
pub struct SlipScratch {
    /// Displacement differences along x, then across.
    differences: Vec<f64>,
    operator: OperatorScratch,
    layer: [Vec<f64>; 2],
    displacement: [Vec<f64>; 2],
}

impl<'a> SlipEquations<'a> {
    /// Sets up a rule for a mesh and its operator. With a parity only the first half of the segments has unknowns. The parity is ignored if the operator is not
    /// folded.
    pub fn new(
        rule: Rule,
        mesh: &Mesh,
        differences: &'a StripOperator,
        parity: Option<Parity>,
    ) -> SlipEquations<'a> {
        let parity = if differences.is_folded() {
            parity
        } else {
            None
        };
        let count = if parity.is_some() {
            differences.segments()
        } else {
            mesh.segments.len()
        };
        let segments = &mesh.segments[..count];
        let mut row = 0;
        let mut equations = SlipEquations {
            rule,
            differences,
            parity,
            stencils: Stencils::new(rule, mesh, segments),
            layer: None,
            flexibility: 0.0,
            memory: None,
            cells: Vec::with_capacity(count),
            rows: Vec::with_capacity(count),
            padded: differences.padded(parity),
            row_count: 0,
            y: Vec::with_capacity(count),
        };
        for (segment, y) in segments.iter().zip(&mesh.load_y) {
            let rows = rows_of(segment.cells.len());
            equations.rows.push(row..row + rows);
            row += rows;
            equations.cells.push(segment.cells.clone());
            equations.y.push(*y);
        }
        equations.row_count = row;
        equations
    }

    /// Returns the equations with an elastic layer of a flexibility between the bodies; 0 means no layer.
    #[must_use]
    pub fn with_layer(mut self, mesh: &Mesh, flexibility: f64) -> SlipEquations<'a> {
        let segments = &mesh.segments[..self.cells.len()];
        self.layer =
            (flexibility > 0.0).then(|| LayerSlip::new(self.rule, mesh, segments, flexibility));
        self.flexibility = flexibility;
        self
    }

    /// Returns the equations of a step in which the displacements change.
    #[must_use]
    pub fn with_memory(mut self, memory: DisplacementMemory<'a>) -> SlipEquations<'a> {
        self.memory = Some(memory);
        self
    }

    /// Number of cells with unknowns.
    pub fn cells(&self) -> usize {
        self.cells.last().map_or(0, |c| c.end)
    }

    /// Length of one component of a vector.
    pub fn padded(&self) -> usize {
        self.padded
    }

    /// Number of segments with unknowns.
    pub fn segments(&self) -> usize {
        self.cells.len()
    }

    /// Cells of a segment.
    pub fn segment(&self, j: usize) -> Range<usize> {
        self.cells[j].clone()
    }

    /// Elastic slip `M T` of tractions `t`. The padding of `slip` is not changed.
    pub fn elastic(&self, t: &[f64], slip: &mut [f64], scratch: &mut SlipScratch) {
        let (tx, ty) = t.split_at(self.padded);
        let (sx, sy) = slip.split_at_mut(self.padded);
        let SlipScratch {
            differences,
            operator,
            layer: buffers,
            displacement,
        } = scratch;
        differences.resize(2 * self.row_count, 0.0);
        let (dx, dy) = differences.split_at_mut(self.row_count);
        self.differences
            .apply(self.parity, tx, ty, dx, dy, operator);
        if self.memory.is_none_or(|memory| memory.rolls) {
            for (cells, rows) in self.cells.iter().zip(&self.rows) {
                for (differences, slip) in [(&*dx, &mut *sx), (&*dy, &mut *sy)] {
                    let slip = &mut slip[cells.clone()];
                    self.stencils
                        .elastic(cells.clone(), &differences[rows.clone()], slip);
                }
                if let Some(layer) = &self.layer {
                    layer.add(cells.clone(), &tx[cells.clone()], sx, buffers);
                    layer.add(cells.clone(), &ty[cells.clone()], sy, buffers);
                }
            }
        } else {
            let cells = self.cells();
            sx[..cells].fill(0.0);
            sy[..cells].fill(0.0);
        }
        if let Some(memory) = self.memory {
            let [ux, uy] = displacement;
            ux.resize(self.padded, 0.0);
            uy.resize(self.padded, 0.0);
            self.at_nodes(memory, [tx, ty], [dx, dy], [ux, uy]);
            for (slip, u) in [(sx, ux), (sy, uy)] {
                let cells = slip.iter_mut().zip(u).take(self.cells());
                cells.for_each(|(slip, u)| *slip -= memory.factor * *u);
            }
        }
    }

    /// Displacements at the nodes from tractions and their displacement differences.
    fn at_nodes(
        &self,
        memory: DisplacementMemory,
        [tx, ty]: [&[f64]; 2],
        [dx, dy]: [&[f64]; 2],
        [ux, uy]: [&mut [f64]; 2],
    ) {
        for (j, (cells, rows)) in self.cells.iter().zip(&self.rows).enumerate() {
            let (own, rows) = (cells.clone(), rows.clone());
            let layer = [tx, ty].map(|t| (self.flexibility, &t[own.clone()]));
            let out = [&mut ux[own.clone()], &mut uy[own]];
            let differences = [&dx[rows.clone()], &dy[rows]];
            memory.at_nodes(j, [tx, ty], differences, layer, out);
        }
    }

    /// Factor of the displacements in the slip of a step; 0 without memory.
    pub fn memory_factor(&self) -> f64 {
        self.memory.map_or(0.0, |memory| memory.factor)
    }

    /// Displacements at the nodes under tractions, including those of a layer, x then y. Does nothing for equations without memory.
    pub fn displacement(&self, t: &[f64], out: &mut [f64], scratch: &mut SlipScratch) {
        let Some(memory) = self.memory else {
            return;
        };
        let (tx, ty) = t.split_at(self.padded);
        let (ux, uy) = out.split_at_mut(self.padded);
        let SlipScratch {
            differences,
            operator,
            ..
        } = scratch;
        differences.resize(2 * self.row_count, 0.0);
        let (dx, dy) = differences.split_at_mut(self.row_count);
        self.differences
            .apply(self.parity, tx, ty, dx, dy, operator);
        self.at_nodes(memory, [tx, ty], [dx, dy], [ux, uy]);
    }

    /// Rigid slip `q = (ν_x − φ y, ν_y + φ x)` of a motion, in the units of the motion, as sampled by the rule.
    pub fn rigid(&self, motion: &Motion) -> Vec<f64> {
        self.given(motion, None)
    }

    /// Rigid slip of a motion plus that of a source.
    pub fn given(&self, motion: &Motion, source: Option<SlipSource>) -> Vec<f64> {
        let mut slip = vec![0.0; 2 * self.padded];
        let (sx, sy) = slip.split_at_mut(self.padded);
        for (cells, y) in self.cells.iter().zip(&self.y) {
            let (x_slip, y_slip) = (&mut sx[cells.clone()], &mut sy[cells.clone()]);
            let along = |_| motion.creepage_x - motion.spin_per_mm * y;
            let across = |x| motion.creepage_y + motion.spin_per_mm * x;
            self.stencils.given(cells.clone(), |_, x| along(x), x_slip);
            self.stencils.given(cells.clone(), |_, x| across(x), y_slip);
            if let Some(source) = source {
                for (slip, given) in [(x_slip, source.x), (y_slip, source.y)] {
                    for (slip, given) in slip.iter_mut().zip(&given[cells.clone()]) {
                        *slip += given;
                    }
                }
            }
        }
        slip
    }

    /// Writes the self-influence block of segment `j` to `blocks`: `M_xx` and `M_yy` between its cells, column by column. `M_xy` is 0 there. `differences` are
    /// buffers.
    pub(crate) fn own_block(
        &self,
        j: usize,
        blocks: [&mut [f64]; 2],
        differences: &mut [Vec<f64>; 2],
    ) {
        let own = self.cells[j].clone();
        let n = own.len();
        // A mirrored segment has the block of its image.
        let stored = if j < self.differences.segments() {
            j
        } else {
            self.segments() - 1 - j
        };
        let (rows, cells) = (
            self.differences.segment_rows(stored),
            self.differences.cells(stored),
        );
        let [xx, yy] = blocks;
        let [dx, dy] = differences;
        for (in_segment, cell) in cells.enumerate() {
            dx.clear();
            dy.clear();
            dx.reserve(rows.len());
            dy.reserve(rows.len());
            for row in rows.clone() {
                let (x, y) = self.differences.own(row, cell, self.parity);
                dx.push(x);
                dy.push(y);
            }
            let column = in_segment * n..(in_segment + 1) * n;
            let (xx, yy) = (&mut xx[column.clone()], &mut yy[column]);
            if self.memory.is_none_or(|memory| memory.rolls) {
                self.stencils.elastic(own.clone(), dx, xx);
                self.stencils.elastic(own.clone(), dy, yy);
                if let Some(layer) = &self.layer {
                    layer.add_column(own.clone(), in_segment, [xx, yy]);
                }
            } else {
                xx.fill(0.0);
                yy.fill(0.0);
            }
            if let Some(memory) = self.memory {
                let place = (own.start + in_segment, in_segment, self.flexibility);
                memory.add_column(j, place, [&dx[..n], &dy[..n]], [xx, yy]);
            }
        }
    }

    /// The whole map `M` as a matrix over the cells without padding, column by column. In rows and in columns, the x components of all cells precede the y
    /// components. It has `(2 × cells)²` values, so it is meant for small meshes.
    ///
    /// # Errors
    /// The monitor may stop the work.
    pub fn dense(&self, monitor: &dyn Monitor) -> Result<Vec<f64>, Stop> {
        let (n, padded) = (self.cells(), self.padded);
        let mut matrix = Vec::with_capacity(4 * n * n);
        let (mut unit, mut slip) = (vec![0.0; 2 * padded], vec![0.0; 2 * padded]);
        let mut scratch = SlipScratch::default();
        for cell in (0..n).chain(padded..padded + n) {
            monitor.go_on(0.0)?;
            unit[cell] = 1.0;
            self.elastic(&unit, &mut slip, &mut scratch);
            unit[cell] = 0.0;
            matrix.extend_from_slice(&slip[..n]);
            matrix.extend_from_slice(&slip[padded..padded + n]);
        }
        Ok(matrix)
    }

    /// Entries of the operator that one product reads.
    pub fn entries(&self) -> usize {
        self.differences.entries(self.parity)
    }
}

/// An elastic layer on the segments of a mesh under one rule.
#[derive(Debug)]
pub(crate) struct LayerSlip {
    /// Displacement over traction, dimensionless.
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

    /// Adds the slip from the tractions of a segment to the slips of the whole mesh.
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

    /// Adds the slips by a unit traction on one cell of a segment, along x and across.
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
    use crate::half_space::strip_operator::kind::Precision;
    use crate::mesh::samples::mesh_between;
    use crate::mesh::{Chord, Grading};
    use crate::monitor::Unmonitored;

    fn parabolic_mesh() -> Mesh {
        mesh_between(0.6, [4, 5], |y| [-1.0 + y * y, 0.8 - y * y])
    }

    #[test]
    fn every_rule_adds_a_source_to_the_slips_of_its_cells() {
        let mesh = parabolic_mesh();
        let influence =
            StripOperator::new(&mesh, 0.3, false, Precision::Double, &Unmonitored).unwrap();
        let motion = Motion {
            creepage_x: 0.3,
            creepage_y: -0.2,
            spin_per_mm: 0.7,
        };
        for rule in [Rule::Upwind, Rule::ThreePoint, Rule::Trapezoid] {
            let equations = SlipEquations::new(rule, &mesh, &influence, None);
            let [x, y] = [1.0, -2.0].map(|seed| {
                let of_cell = |i: usize| (seed * i as f64).sin();
                (0..equations.cells()).map(of_cell).collect::<Vec<f64>>()
            });
            let with_source = equations.given(&motion, Some(SlipSource { x: &x, y: &y }));
            let rigid = equations.rigid(&motion);
            for i in 0..equations.cells() {
                let j = equations.padded() + i;
                assert_eq!(with_source[i], rigid[i] + x[i]);
                assert_eq!(with_source[j], rigid[j] + y[i]);
            }
        }
    }

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
