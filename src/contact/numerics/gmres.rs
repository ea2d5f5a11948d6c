//! GMRES with right preconditioning (Saad & Schultz 1986) for linear systems given by their products.

use crate::monitor::Stop;

/// Largest number of basis vectors. A Newton step takes 4 products on average; 30 gives the same work on the 160 ellipses named in `newton.rs` of the boundary
/// element method.
const BASIS_MAX: usize = 60;

/// Buffers of successive solves.
#[derive(Debug, Default)]
pub struct Gmres {
    basis: Vec<Vec<f64>>,
    /// Upper triangle of the rotated Hessenberg matrix, column by column.
    columns: Vec<f64>,
    rotations: Vec<(f64, f64)>,
    rhs: Vec<f64>,
    /// `P⁻¹ V`, so that the solution needs no application of the preconditioner.
    directions: Vec<Vec<f64>>,
    product: Vec<f64>,
    weights: Vec<f64>,
}

/// Report of a linear solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearReport {
    /// Products with the matrix.
    pub products: u32,
    /// Norm of the residual over that of the right-hand side.
    pub residual: f64,
    /// Whether the residual reached the tolerance.
    pub converged: bool,
}

/// A linear system given by its action.
pub trait LinearSystem {
    /// `out = A x`.
    fn product(&mut self, x: &[f64], out: &mut [f64]);
    /// `x ← P⁻¹ x` with P close to A.
    fn precondition(&mut self, x: &mut [f64]);
    /// Called once per product.
    ///
    /// # Errors
    /// Why the work must end.
    fn tick(&mut self) -> Result<(), Stop>;
}

impl Gmres {
    /// Improves `x`, which starts at zero, until the norm of the residual of `A x = b` is at most `tolerance` times that of `b`, or the basis is full.
    ///
    /// # Errors
    /// Only if the system's `tick` stops the work.
    pub fn solve(
        &mut self,
        system: &mut dyn LinearSystem,
        b: &[f64],
        tolerance: f64,
        x: &mut [f64],
    ) -> Result<LinearReport, Stop> {
        x.fill(0.0);
        let norm_b = norm(b);
        let mut report = LinearReport {
            products: 0,
            residual: 0.0,
            converged: true,
        };
        if norm_b == 0.0 {
            return Ok(report);
        }
        self.product.resize(b.len(), 0.0);
        let goal = tolerance * norm_b;
        let beta = self.iterate(system, b, norm_b, goal, x, &mut report)?;
        report.residual = beta / norm_b;
        // False if the residual is not a number.
        report.converged = beta <= goal;
        Ok(report)
    }

    /// The Arnoldi iteration from zero; returns the norm of the residual at its end.
    fn iterate(
        &mut self,
        system: &mut dyn LinearSystem,
        b: &[f64],
        beta: f64,
        goal: f64,
        x: &mut [f64],
        report: &mut LinearReport,
    ) -> Result<f64, Stop> {
        self.rotations.clear();
        self.rhs.clear();
        self.rhs.push(beta);
        self.set_basis(0, b, beta);
        let mut k = 0;
        while k < BASIS_MAX {
            system.tick()?;
            if self.directions.len() <= k {
                self.directions.push(Vec::new());
            }
            let direction = &mut self.directions[k];
            direction.clear();
            direction.extend_from_slice(&self.basis[k]);
            // With right preconditioning the residual is that of the system itself, so the tolerance does not depend on the preconditioner.
            system.precondition(direction);
            system.product(direction, &mut self.product);
            report.products += 1;
            let breakdown = self.orthogonalise(k);
            k += 1;
            // The last rotated entry is the norm of the residual, so the solution need not be formed.
            if breakdown || self.rhs[k].abs() <= goal {
                break;
            }
        }
        self.add_solution(k, x);
        Ok(self.rhs[k].abs())
    }

    fn set_basis(&mut self, k: usize, vector: &[f64], norm: f64) {
        if self.basis.len() <= k {
            self.basis.push(vec![0.0; vector.len()]);
        }
        let basis = &mut self.basis[k];
        basis.resize(vector.len(), 0.0);
        for (to, from) in basis.iter_mut().zip(vector) {
            *to = from / norm;
        }
    }

    /// Orthogonalises the last product against the basis (modified Gram–Schmidt), appends it, and applies the Givens rotations. Returns true if the product lies in the
    /// span of the basis, which ends the cycle.
    fn orthogonalise(&mut self, k: usize) -> bool {
        let before = norm(&self.product);
        self.columns.resize(column_start(k + 1), 0.0);
        let column = &mut self.columns[column_start(k)..];
        for (entry, basis) in column.iter_mut().zip(&self.basis) {
            let h = dot(basis, &self.product);
            for (p, b) in self.product.iter_mut().zip(basis) {
                *p -= h * b;
            }
            *entry = h;
        }
        let rest = norm(&self.product);
        for (i, (c, s)) in self.rotations.iter().enumerate() {
            let (a, b) = (column[i], column[i + 1]);
            column[i] = c * a + s * b;
            column[i + 1] = c * b - s * a;
        }
        let length = column[k].hypot(rest);
        let (c, s) = if length == 0.0 {
            (1.0, 0.0)
        } else {
            (column[k] / length, rest / length)
        };
        column[k] = length;
        self.rotations.push((c, s));
        let last = self.rhs[k];
        self.rhs[k] = c * last;
        self.rhs.push(-s * last);
        // The remainder is rounding noise.
        if rest <= 1e-14 * before {
            return true;
        }
        let product = std::mem::take(&mut self.product);
        self.set_basis(k + 1, &product, rest);
        self.product = product;
        false
    }

    /// `x ← x + P⁻¹ V y` with `y` from the triangular system.
    fn add_solution(&mut self, k: usize, x: &mut [f64]) {
        let y = &mut self.weights;
        y.clear();
        y.extend_from_slice(&self.rhs[..k]);
        for i in (0..k).rev() {
            for j in i + 1..k {
                y[i] -= self.columns[column_start(j) + i] * y[j];
            }
            // A pivot of 0 belongs to a singular system; its direction is skipped.
            let pivot = self.columns[column_start(i) + i];
            y[i] = if pivot == 0.0 { 0.0 } else { y[i] / pivot };
        }
        // Directions of a longer cycle may follow; the weights end the sum.
        for (weight, direction) in self.weights.iter().zip(&self.directions) {
            for (to, d) in x.iter_mut().zip(direction) {
                *to += weight * d;
            }
        }
    }
}

/// The start of column k, which has k + 1 entries, in the triangular matrix.
fn column_start(k: usize) -> usize {
    k * (k + 1) / 2
}

/// Inner product in eight running sums, which can be vectorised and round alike on every machine.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (chunks_a, chunks_b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = chunks_a
        .remainder()
        .iter()
        .zip(chunks_b.remainder())
        .map(|(x, y)| x * y)
        .sum();
    for (x, y) in chunks_a.zip(chunks_b) {
        for k in 0..8 {
            sums[k] += x[k] * y[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Dense {
        n: usize,
        a: Vec<f64>,
        diagonal: bool,
    }

    impl LinearSystem for Dense {
        fn product(&mut self, x: &[f64], out: &mut [f64]) {
            for (out, row) in out.iter_mut().zip(self.a.chunks_exact(self.n)) {
                *out = dot(row, x);
            }
        }

        fn precondition(&mut self, x: &mut [f64]) {
            if self.diagonal {
                for (x, pivot) in x.iter_mut().zip(self.a.iter().step_by(self.n + 1)) {
                    *x /= pivot;
                }
            }
        }

        fn tick(&mut self) -> Result<(), Stop> {
            Ok(())
        }
    }

    fn nonsymmetric(n: usize, diagonal: bool) -> Dense {
        let entry = |i: usize, j: usize| {
            let wave = ((3 * i + 7 * j) as f64).sin() / (1.0 + i.abs_diff(j) as f64);
            wave + if i == j { 4.0 + i as f64 } else { 0.0 }
        };
        Dense {
            n,
            a: (0..n * n).map(|k| entry(k / n, k % n)).collect(),
            diagonal,
        }
    }

    #[test]
    fn the_residual_falls_to_the_tolerance_asked_for() {
        for diagonal in [false, true] {
            for n in [1, 5, 50] {
                let mut system = nonsymmetric(n, diagonal);
                let b: Vec<f64> = (0..n).map(|i| (i as f64).cos()).collect();
                let mut x = vec![0.0; n];
                let report = Gmres::default()
                    .solve(&mut system, &b, 1e-10, &mut x)
                    .unwrap();
                let mut ax = vec![0.0; n];
                system.product(&x, &mut ax);
                let error: f64 = ax
                    .iter()
                    .zip(&b)
                    .map(|(a, b)| (a - b).powi(2))
                    .sum::<f64>()
                    .sqrt();
                assert!(
                    error <= 1.1e-10 * norm(&b) && report.residual <= 1e-10,
                    "{n} {error} {report:?}"
                );
                assert!(report.converged);
            }
        }
    }

    #[test]
    fn a_good_preconditioner_saves_products() {
        let b = vec![1.0; 90];
        let products = |diagonal| {
            let mut x = vec![0.0; 90];
            Gmres::default()
                .solve(&mut nonsymmetric(90, diagonal), &b, 1e-8, &mut x)
                .unwrap()
                .products
        };
        assert!(products(true) < products(false));
    }

    #[test]
    fn a_linear_solve_that_falls_short_says_so() {
        // A cyclic shift: the residual does not fall until the basis spans the whole space.
        struct Ring;
        impl LinearSystem for Ring {
            fn product(&mut self, x: &[f64], out: &mut [f64]) {
                for i in 0..x.len() {
                    out[(i + 1) % x.len()] = x[i];
                }
            }

            fn precondition(&mut self, _: &mut [f64]) {}

            fn tick(&mut self) -> Result<(), Stop> {
                Ok(())
            }
        }
        let mut b = vec![0.0; 2000];
        b[0] = 1.0;
        let mut x = vec![0.0; 2000];
        let report = Gmres::default().solve(&mut Ring, &b, 1e-3, &mut x).unwrap();
        assert!(!report.converged);
        assert!(!report.converged && report.residual > 0.9, "{report:?}");
    }

    #[test]
    fn nothing_to_solve_costs_nothing() {
        let mut x = vec![1.0; 5];
        let report = Gmres::default()
            .solve(&mut nonsymmetric(5, false), &[0.0; 5], 1e-8, &mut x)
            .unwrap();
        assert_eq!((report.products, x), (0, vec![0.0; 5]));
    }
}
