//! Coupling of pressure and traction for bodies that differ: tangential displacements by pressure and normal ones by traction; and the elastic constants of a pair.
//!
//! With K of the pair, the distances p = x − x′ and q = y − y′ to the corners of a cell, and [[·]] their sum with alternating signs, a pressure P moves the surfaces apart
//! by `u_x = K P/(πG) [[p atan(q/p) + q ln r]]`, and by `u_y` with p and q exchanged. Tractions open the gap by minus the same sums (Kalker 1990, section 1.6; Johnson
//! 1985, section 3.6).

use std::f64::consts::{FRAC_PI_2, PI};

use crate::mesh::{Mesh, Segment};

/// `p atan(q/p) + q ln r`, and the same with p and q exchanged.
fn corner(p: f64, q: f64) -> [f64; 2] {
    let (p_q, q_p) = (p.abs(), q.abs());
    if p_q == 0.0 && q_p == 0.0 {
        return [0.0; 2];
    }
    let log = 0.5 * (p * p + q * q).ln();
    // p atan(q/p) = |p| atan(q/|p|), and the two angles of a triangle add up to π/2.
    let angle = q_p.atan2(p_q);
    let along = p_q * angle.copysign(q);
    let across = q_p * (FRAC_PI_2 - angle).copysign(p);
    [along + q * log, across + p * log]
}

/// Calls `each` with every cell of a segment and its two corner sums at a place.
fn of_segment(
    mesh: &Mesh,
    segment: &Segment,
    [x, y]: [f64; 2],
    mut each: impl FnMut(usize, [f64; 2]),
) {
    let half = 0.5 * segment.chord.dy;
    let (q1, q2) = (y - segment.chord.y + half, y - segment.chord.y - half);
    let edge = |at: f64| {
        let p = x - at;
        let (low, high) = (corner(p, q1), corner(p, q2));
        [low[0] - high[0], low[1] - high[1]]
    };
    let mut left = edge(mesh.left[segment.cells.start]);
    for cell in segment.cells.clone() {
        let right = edge(mesh.right[cell]);
        each(cell, [left[0] - right[0], left[1] - right[1]]);
        left = right;
    }
}

/// The corner sums at a place for a cell of a size about the origin.
fn of_cell([x, y]: [f64; 2], size: [f64; 2]) -> [f64; 2] {
    let [dx, dy] = size.map(|size| 0.5 * size);
    let [a, b, c, d] =
        [(dx, dy), (dx, -dy), (-dx, dy), (-dx, -dy)].map(|(p, q)| corner(x + p, y + q));
    [0, 1].map(|k| a[k] - b[k] - (c[k] - d[k]))
}

/// Displacements along x and across at a place by unit pressure on a cell of a size about the origin, times G.
pub fn displacement_by_cell(difference: f64, at: [f64; 2], size: [f64; 2]) -> [f64; 2] {
    of_cell(at, size).map(|sum| difference / PI * sum)
}

/// Displacements along x and across at a place by pressures on all cells, times G.
pub fn displacement(mesh: &Mesh, difference: f64, pressure: &[f64], at: [f64; 2]) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for segment in &mesh.segments {
        of_segment(mesh, segment, at, |cell, [x, y]| {
            sum[0] += pressure[cell] * x;
            sum[1] += pressure[cell] * y;
        });
    }
    sum.map(|sum| difference / PI * sum)
}

/// Mean slips of all cells by pressures, along x and across, times G: the differences of the displacements at their two edges over their lengths.
pub fn pressure_slips(mesh: &Mesh, difference: f64, pressure: &[f64]) -> [Vec<f64>; 2] {
    let mut slips = [0, 1].map(|_| Vec::with_capacity(mesh.cells()));
    for segment in &mesh.segments {
        let y = segment.chord.y;
        let at = |x: f64| displacement(mesh, difference, pressure, [x, y]);
        let mut behind = at(mesh.left[segment.cells.start]);
        for cell in segment.cells.clone() {
            let ahead = at(mesh.right[cell]);
            let length = mesh.right[cell] - mesh.left[cell];
            for (k, slips) in slips.iter_mut().enumerate() {
                slips.push((ahead[k] - behind[k]) / length);
            }
            behind = ahead;
        }
    }
    slips
}

/// The opening of the gap at a place by tractions on all cells, times G.
pub fn opening(mesh: &Mesh, difference: f64, traction: &[Vec<f64>; 2], at: [f64; 2]) -> f64 {
    let mut sum = 0.0;
    for segment in &mesh.segments {
        of_segment(mesh, segment, at, |cell, [x, y]| {
            sum += traction[0][cell] * x + traction[1][cell] * y;
        });
    }
    -difference / PI * sum
}

/// Combined elastic constants of a pair of bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elasticity {
    /// Combined shear modulus G in MPa.
    pub shear_modulus: f64,
    /// Combined Poisson's ratio, 0 to 0.5.
    pub poisson_ratio: f64,
    /// Difference parameter K (Kalker 1990, eq. 1.44); 0 for like bodies.
    pub difference: f64,
    /// Part of the normal displacement of both bodies that belongs to the lower one; ½ for like bodies.
    pub lower_share: f64,
}

impl Elasticity {
    /// Whether the bodies have different elastic constants.
    pub fn differs(&self) -> bool {
        self.difference != 0.0 || self.lower_share != 0.5
    }

    /// Contact modulus `E* = G/(1−ν)` in MPa, that is `1/E* = (1−ν₁²)/E₁ + (1−ν₂²)/E₂`.
    pub fn contact_modulus(&self) -> f64 {
        self.shear_modulus / (1.0 - self.poisson_ratio)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Chord;
    use crate::mesh::Grading;

    /// Corner sums of the rectangle |x| ≤ 0.5, |y| ≤ 0.3, computed with 40 digits and written with 12.
    #[test]
    fn the_sums_of_a_rectangle_have_their_known_digits() {
        let chord = Chord {
            patch: 0,
            strip: 0,
            y: 0.0,
            dy: 0.6,
            left: -0.5,
            right: 0.5,
        };
        let mesh = Mesh::new(&[chord], &Grading::cosine(1));
        let known = [
            ([0.0, 0.0], [0.0, 0.0]),
            ([0.2, -0.1], [0.435259239426, -0.39252479516]),
            ([0.5, 0.3], [0.939160284455, 0.771968445789]),
            ([0.5, 0.0], [1.33115058042, 0.0]),
            ([1.3, 0.7], [0.358796701993, 0.202538551528]),
            ([50.0, -20.0], [0.0103449128709, -0.00413811734688]),
        ];
        for (at, sums) in known {
            of_segment(&mesh, &mesh.segments[0], at, |_, found| {
                for k in [0, 1] {
                    assert!((found[k] - sums[k]).abs() < 1e-11, "{at:?}: {found:?}");
                }
            });
        }
    }

    /// Hertz's pressure on four equal strips of the ellipse a = 1, b = 1.5 with six cells each, K = 0.2: values of an independent program.
    #[test]
    fn slips_and_openings_of_an_ellipse_have_their_known_digits() {
        let half = |y: f64| (1.0 - (y / 1.5_f64).powi(2)).sqrt();
        let chord = |strip: usize| {
            let y = -1.125 + 0.75 * strip as f64;
            Chord {
                patch: 0,
                strip,
                y,
                dy: 0.75,
                left: -half(y),
                right: half(y),
            }
        };
        let chords: Vec<Chord> = (0..4).map(chord).collect();
        let mesh = Mesh::new(&chords, &Grading::cosine(6));
        let y = mesh.cell_load_y();
        let pressure: Vec<f64> = (0..mesh.cells())
            .map(|i| {
                let a = half(y[i]);
                let below = |x: f64| {
                    let s = (x / a).clamp(-1.0, 1.0);
                    0.5 * a * a * (s * (1.0 - s * s).sqrt() + s.asin())
                };
                (below(mesh.right[i]) - below(mesh.left[i])) / (mesh.right[i] - mesh.left[i])
            })
            .collect();
        let second = mesh.segments[1].cells.clone();
        let [x, y] = pressure_slips(&mesh, 0.2, &pressure);
        let known_x = [0.0163312495, 0.1419171248, 0.2232723393];
        let known_y = [-0.03336035089, -0.02231203025, -0.005740556315];
        for k in 0..3 {
            let (i, image) = (second.start + k, second.end - 1 - k);
            assert!(
                (x[i] - known_x[k]).abs() < 1e-9 && (x[image] - known_x[k]).abs() < 1e-9,
                "{x:?}"
            );
            assert!(
                (y[i] - known_y[k]).abs() < 1e-9 && (y[image] + known_y[k]).abs() < 1e-9,
                "{y:?}"
            );
        }
        let none = vec![0.0; mesh.cells()];
        let node = |k: usize| [mesh.node[second.start + k], mesh.segments[1].chord.y];
        let along = [pressure.clone(), none.clone()];
        let across = [none, pressure];
        for (k, known) in [0.159784291, 0.1355866171, 0.05568279874]
            .into_iter()
            .enumerate()
        {
            assert!((opening(&mesh, 0.2, &along, node(k)) - known).abs() < 1e-9);
        }
        for (k, known) in [0.04084236734, 0.04828587361, 0.05407310347]
            .into_iter()
            .enumerate()
        {
            assert!((opening(&mesh, 0.2, &across, node(k)) - known).abs() < 1e-9);
        }
    }
}
