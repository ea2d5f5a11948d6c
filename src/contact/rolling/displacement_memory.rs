//! Displacements in transient rolling, whose change in time is a part of the slip.
//!
//! In a frame that moves with the contact, slip is `s = w + ∂u/∂x − ∂u/∂q` with the distance rolled q (Kalker 1990, eq. 1.44; Johnson 1985, eq. 8.2 in time).
//! The strip operator gives differences of u along a strip; together with u at the leading edge of every strip they give u at all nodes.

use crate::half_space::kernels::{Rectangle, rectangle};
use crate::half_space::strip_operator::kind::Parity;
use crate::mesh::Mesh;

/// Displacements at the leading edge of every strip per unit traction on every cell, for the unknowns of a parity.
#[derive(Debug, Clone)]
pub struct LeadingEdges {
    /// The rows `[xx, u_x from T_y, u_y from T_x, yy]` over the cells, for every strip.
    rows: Vec<[Vec<f64>; 4]>,
}

impl LeadingEdges {
    /// The edges of a dimensionless mesh. With a parity, those of the first half of its strips, including the effect of their mirror images.
    pub fn new(mesh: &Mesh, nu: f64, parity: Option<Parity>) -> LeadingEdges {
        let strips = match parity {
            None => mesh.segments.len(),
            Some(_) => mesh.segments.len() / 2,
        };
        let cells: usize = mesh.segments[..strips].iter().map(|s| s.cells.len()).sum();
        // Signs of the mirrored tractions along x and across.
        let signs = match parity {
            None => [0.0; 2],
            Some(Parity::Longitudinal) => [1.0, -1.0],
            Some(Parity::Lateral) => [-1.0, 1.0],
        };
        let row = |j: usize| {
            let (x, y) = (mesh.segments[j].chord.right, mesh.segments[j].chord.y);
            let mut row = [0; 4].map(|_| vec![0.0; cells]);
            for (k, segment) in mesh.segments.iter().enumerate() {
                let (y0, dy) = (segment.chord.y, 0.5 * segment.chord.dy);
                let image = (k >= strips).then(|| &mesh.segments[mesh.segments.len() - 1 - k]);
                let first = image.map_or(segment.cells.start, |image| image.cells.start);
                let [sx, sy] = if image.is_some() { signs } else { [1.0; 2] };
                for (i, cell) in segment.cells.clone().enumerate() {
                    let (x0, x1) = (mesh.left[cell], mesh.right[cell]);
                    let (y0, y1) = (y0 - dy, y0 + dy);
                    let found = rectangle(x, y, Rectangle { x0, x1, y0, y1 }, nu);
                    let values = [sx * found.xx, sy * found.xy, sx * found.xy, sy * found.yy];
                    for (row, value) in row.iter_mut().zip(values) {
                        row[first + i] += value;
                    }
                }
            }
            row
        };
        LeadingEdges {
            rows: (0..strips).map(row).collect(),
        }
    }

    /// Displacements at the edge of strip `j` under tractions.
    fn displacement(&self, j: usize, tx: &[f64], ty: &[f64]) -> [f64; 2] {
        let [xx, xy, yx, yy] = &self.rows[j];
        let sum = |along: &[f64], across: &[f64]| {
            let sums = along.iter().zip(tx).zip(across.iter().zip(ty));
            sums.map(|((a, x), (b, y))| a * x + b * y).sum::<f64>()
        };
        [sum(xx, xy), sum(yx, yy)]
    }

    /// The displacements along x and across at the edge of strip `j` per unit traction of a cell in the same direction.
    fn own(&self, j: usize, cell: usize) -> [f64; 2] {
        [self.rows[j][0][cell], self.rows[j][3][cell]]
    }
}

/// The dependence of the slip of a step on the displacements at its end.
#[derive(Debug, Clone, Copy)]
pub struct DisplacementMemory<'a> {
    /// Displacements at the leading edges.
    pub edges: &'a LeadingEdges,
    /// Factor of the displacement at the end of the step, per dimensionless distance rolled; 1 for a shift.
    pub factor: f64,
    /// Whether the bodies roll in the step. In a shift they only slide.
    pub rolls: bool,
}

impl DisplacementMemory<'_> {
    /// Writes the displacements at the nodes of strip `j`: those at its edge minus the differences up to the node, plus the shear of a layer of a flexibility.
    pub(crate) fn at_nodes(
        &self,
        j: usize,
        [tx, ty]: [&[f64]; 2],
        differences: [&[f64]; 2],
        layer: [(f64, &[f64]); 2],
        out: [&mut [f64]; 2],
    ) {
        let edge = self.edges.displacement(j, tx, ty);
        for k in 0..2 {
            let mut u = edge[k];
            let (flexibility, own) = layer[k];
            let nodes = out[k].iter_mut().zip(own).zip(differences[k]).rev();
            for ((out, own), difference) in nodes {
                u -= difference;
                *out = u + flexibility * own;
            }
        }
    }

    /// Subtracts the displacements by a unit traction on a cell of the strip from the columns of its self-influence block; `place` is the number of the cell in
    /// the strip.
    pub(crate) fn add_column(
        &self,
        j: usize,
        (cell, place, flexibility): (usize, usize, f64),
        differences: [&[f64]; 2],
        columns: [&mut [f64]; 2],
    ) {
        let edge = self.edges.own(j, cell);
        for ((mut u, differences), column) in edge.into_iter().zip(differences).zip(columns) {
            for (k, (out, difference)) in column.iter_mut().zip(differences).enumerate().rev() {
                u -= difference;
                let own = if k == place { flexibility } else { 0.0 };
                *out -= self.factor * (u + own);
            }
        }
    }
}
