//! Elimination of the stick tractions, so that slip on the slip cells is a function of their own tractions (eq. 11 to 13).

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};

use crate::monitor::{Monitor, Stop};
use crate::numerics::lu;
use crate::rolling::methods::boundary_element::task::NewtonTask;
use crate::rolling::slip_equations::SlipEquations;
use crate::rolling::slip_rules::Rule;
use crate::rolling::task::Motion;

/// The discrete problem as dense arrays over the cells without padding, x components before y components.
#[derive(Debug)]
pub struct DenseProblem {
    /// The rule of the map.
    pub rule: Rule,
    /// Number of cells.
    pub cells: usize,
    /// Length of one component in the layout of the equations.
    padded: usize,
    /// The map `M` from tractions to slips, `2 × cells` square.
    pub map: Mat<f64>,
    /// Rigid slip q.
    pub rigid: Vec<f64>,
    /// Friction bound g of every cell.
    pub bound: Vec<f64>,
    /// x of every node.
    pub x: Vec<f64>,
    /// y of every node.
    pub y: Vec<f64>,
    /// The motion, of which only the direction of rigid slip is used.
    pub motion: Motion,
}

impl DenseProblem {
    /// Assembles the map as a matrix.
    ///
    /// # Errors
    /// Only if the monitor stops the work.
    pub fn new(stage: &DenseTask, monitor: &dyn Monitor) -> Result<DenseProblem, Stop> {
        let DenseTask { equations, law, .. } = stage;
        let (n, padded) = (equations.cells(), equations.padded());
        let values = equations.dense(monitor)?;
        monitor.go_on(0.0)?;
        let map = MatRef::from_column_major_slice(&values, 2 * n, 2 * n).to_owned();
        monitor.go_on(0.0)?;
        Ok(DenseProblem {
            rule: equations.rule,
            cells: n,
            padded,
            map,
            rigid: [&law.rigid[..n], &law.rigid[padded..padded + n]].concat(),
            bound: law.bound[..n].to_vec(),
            x: stage.nodes.0[..n].to_vec(),
            y: stage.nodes.1[..n].to_vec(),
            motion: stage.motion,
        })
    }

    /// Removes the padding of a vector in the layout of the equations.
    pub fn compact(&self, values: &[f64]) -> Vec<f64> {
        let (n, padded) = (self.cells, self.padded);
        [&values[..n], &values[padded..padded + n]].concat()
    }

    /// The inverse of [`compact`](Self::compact).
    pub fn padded(&self, values: &[f64]) -> Vec<f64> {
        let (n, padded) = (self.cells, self.padded);
        let mut out = vec![0.0; 2 * padded];
        out[..n].copy_from_slice(&values[..n]);
        out[padded..padded + n].copy_from_slice(&values[n..]);
        out
    }
}

/// The slip cells after elimination of the stick cells: `s = q' + K t_S`, for one division into zones.
///
/// With the map divided by zones, stick cells satisfy `0 = q_L + M_LL t_L + M_LS t_S` (eq. 11 with `A = −M_LL`, `B = −M_LS`, `e = q_L`), and slip cells
/// `s = q_S + M_SL t_L + M_SS t_S` (eq. 12 with `C = −M_SL`, `D = −M_SS`). So `q' = q − C A⁻¹ e` and `K = C A⁻¹ B − D` (eq. 13), or `K = −D` without stick
/// cells. Cells without pressure have no traction and no unknowns.
#[derive(Debug)]
pub struct SlipSystem {
    /// The cells with unknown tractions.
    pub slip_cells: Vec<usize>,
    /// The cells that stick.
    pub stick_cells: Vec<usize>,
    /// K, square; x of all slip cells before y.
    pub response: Mat<f64>,
    /// q'.
    pub constant: Vec<f64>,
    /// X: `A⁻¹ B` with the additional column `−A⁻¹ e`, so that `t_L = −X (t_S, 1)`.
    stick_response: Mat<f64>,
}

impl SlipSystem {
    /// Eliminates the stick cells.
    ///
    /// # Errors
    /// Only if the monitor stops the work.
    pub fn new(
        task: &DenseProblem,
        slips: &[bool],
        monitor: &dyn Monitor,
    ) -> Result<SlipSystem, Stop> {
        let cells = 0..task.cells;
        let slip_cells: Vec<usize> = cells
            .clone()
            .filter(|i| slips[*i] && task.bound[*i] > 0.0)
            .collect();
        let stick_cells: Vec<usize> = cells.filter(|i| !slips[*i]).collect();
        let (slip, stick) = (
            both_components(&slip_cells, task.cells),
            both_components(&stick_cells, task.cells),
        );
        let known = |rows: &[usize]| {
            Mat::from_fn(rows.len(), slip.len() + 1, |i, j| {
                if j < slip.len() {
                    task.map[(rows[i], slip[j])]
                } else {
                    task.rigid[rows[i]]
                }
            })
        };
        monitor.go_on(0.0)?;
        let mut on_slip = known(&slip);
        monitor.go_on(0.0)?;
        let mut on_stick = known(&stick);
        if !stick.is_empty() {
            let part = |rows: &[usize]| {
                Mat::from_fn(rows.len(), stick.len(), |i, j| {
                    task.map[(rows[i], stick[j])]
                })
            };
            lu::solve(&part(&stick), on_stick.as_mut(), monitor)?;
            monitor.go_on(0.0)?;
            let by_stick = part(&slip);
            matmul(
                on_slip.as_mut(),
                Accum::Add,
                by_stick.as_ref(),
                on_stick.as_ref(),
                -1.0,
                Par::Seq,
            );
        }
        let constant = (0..slip.len()).map(|i| on_slip[(i, slip.len())]).collect();
        on_slip.truncate(slip.len(), slip.len());
        Ok(SlipSystem {
            slip_cells,
            stick_cells,
            response: on_slip,
            constant,
            stick_response: on_stick,
        })
    }

    /// Slip on the slip cells for their tractions.
    pub fn slip(&self, t_slip: &[f64]) -> Vec<f64> {
        let mut slip = self.constant.clone();
        add_product(&mut slip, self.response.as_ref(), t_slip, 1.0);
        slip
    }

    /// Tractions of the stick cells for those of the slip cells.
    pub fn stick_tractions(&self, t_slip: &[f64]) -> Vec<f64> {
        let mut t = vec![0.0; 2 * self.stick_cells.len()];
        let factors = [t_slip, &[1.0]].concat();
        add_product(&mut t, self.stick_response.as_ref(), &factors, -1.0);
        t
    }
}

/// Indices of both components of chosen cells in a vector over all `cells`.
pub fn both_components(chosen: &[usize], cells: usize) -> Vec<usize> {
    let y = chosen.iter().map(|i| cells + i);
    chosen.iter().copied().chain(y).collect()
}

/// `to ← to + factor A x`.
fn add_product(to: &mut [f64], a: MatRef<'_, f64>, x: &[f64], factor: f64) {
    let (rows, columns) = (to.len(), x.len());
    matmul(
        MatMut::from_column_major_slice_mut(to, rows, 1),
        Accum::Add,
        a,
        MatRef::from_column_major_slice(x, columns, 1),
        factor,
        Par::Seq,
    );
}

/// The problem on one mesh. All values are dimensionless, as in [`SlipEquations`].
#[derive(Debug, Clone, Copy)]
pub struct DenseTask<'a> {
    /// The discrete equations over the whole mesh, without parity.
    pub equations: &'a SlipEquations<'a>,
    /// Friction bound, rigid slip, tolerance.
    pub law: NewtonTask<'a>,
    /// x and y of every cell's node.
    pub nodes: (&'a [f64], &'a [f64]),
    /// The motion, of which only the direction of rigid slip is used.
    pub motion: Motion,
}
