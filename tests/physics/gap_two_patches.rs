//! Tests two patches of different size in one gap: both are resolved, or the answer says that one is not.

use railhead_contact::normal::hertz::{Ellipse, NormalLoad};
use railhead_contact::remark::entry::RemarkEntry;
use railhead_contact::solution::words::answer::Solution;
use serde_json::json;

use crate::gap_samples::{profile, spread, steel};
use crate::reference::solve;

/// `E* = G/(1−ν)` of the pair in MPa.
const MODULUS: f64 = 82000.0 / 0.72;
const ROLLING: f64 = 460.0;
const APART: f64 = 16.0;

/// Two Hertz contacts, each with the displacement due to the other at its place.
struct Neighbours {
    ellipses: [Ellipse; 2],
}

impl Neighbours {
    /// Returns paraboloids of two lateral radii under a total force. The loads give both the same approach, including the displacement due to the
    /// other patch at the centre. The curvatures are reduced by those of that displacement.
    fn new(radii: [f64; 2], force: f64) -> Neighbours {
        let mut curvatures = radii.map(|radius| [1.0 / ROLLING, 1.0 / radius]);
        let mut first = 0.9 * force;
        let mut ellipses = hertz(curvatures, [first, force - first]);
        for _ in 0..60 {
            let deflections = [bend(&ellipses[1]), bend(&ellipses[0])];
            for k in 0..2 {
                let [_, along, across] = deflections[k];
                curvatures[k] = [1.0 / ROLLING + along, 1.0 / radii[k] + across];
            }
            let excess = |share: f64| {
                let ellipses = hertz(curvatures, [share, force - share]);
                let of = |k: usize| ellipses[k].approach + bend(&ellipses[1 - k])[0];
                of(0) - of(1)
            };
            let (mut low, mut high) = (0.01 * force, 0.999_99 * force);
            for _ in 0..60 {
                first = 0.5 * (low + high);
                *(if excess(first) < 0.0 {
                    &mut low
                } else {
                    &mut high
                }) = first;
            }
            ellipses = hertz(curvatures, [first, force - first]);
        }
        Neighbours { ellipses }
    }
}

fn hertz(curvatures: [[f64; 2]; 2], forces: [f64; 2]) -> [Ellipse; 2] {
    [0, 1].map(|k| {
        let [along, across] = curvatures[k].map(|curvature| 1.0 / curvature);
        Ellipse::of_radii(along, across, NormalLoad::Force(forces[k]), MODULUS)
    })
}

/// Returns the displacement at the centre of the other patch and its second derivatives along and across, by quadrature.
fn bend(ellipse: &Ellipse) -> [f64; 3] {
    const COUNT: usize = 40;
    let mut sums = [0.0; 3];
    let at = |k: usize| (2 * k + 1) as f64 / COUNT as f64 - 1.0;
    for (u, v) in (0..COUNT).flat_map(|i| (0..COUNT).map(move |j| (at(i), at(j)))) {
        let pressure = ellipse.pressure_max * (1.0 - u * u - v * v).max(0.0).sqrt();
        let area = 4.0 * ellipse.a * ellipse.b / (COUNT * COUNT) as f64;
        let (x, y) = (ellipse.a * u, APART - ellipse.b * v);
        let r = x.hypot(y);
        let factor = pressure * area / (std::f64::consts::PI * MODULUS);
        sums[0] += factor / r;
        sums[1] += factor * (3.0 * x * x / r.powi(5) - 1.0 / r.powi(3));
        sums[2] += factor * (3.0 * y * y / r.powi(5) - 1.0 / r.powi(3));
    }
    sums
}

fn solved(radii: [f64; 2], force: f64) -> Solution {
    let y = spread(-20.0, 20.0, 961);
    let parabola = |y: f64, middle: f64, radius: f64| (y - middle).powi(2) / (2.0 * radius);
    let contact = profile(ROLLING, &y, |y| {
        parabola(y, -0.5 * APART, radii[0]).min(parabola(y, 0.5 * APART, radii[1]))
    });
    let case = steel(
        contact,
        json!({ "normal_force_n": force }),
        [1e-3, 0.0, 0.0],
    );
    solve(&case).0
}

#[test]
fn a_small_patch_beside_a_large_one_is_hertzs_contact_with_its_neighbours_deflection() {
    for radius in [60.0, 6.0, 1.0] {
        let expected = Neighbours::new([300.0, radius], 60e3).ellipses;
        let solution = solved([300.0, radius], 60e3);
        assert_eq!(solution.patches.len(), 2, "{radius}");
        for (patch, hertz) in solution.patches.iter().zip(&expected) {
            let force = 2.0 / 3.0 * std::f64::consts::PI * hertz.a * hertz.b * hertz.pressure_max;
            let width = patch.extent_mm[3] - patch.extent_mm[2];
            for (name, found, expected) in [
                ("force", patch.normal_force_n, force),
                ("width", width, 2.0 * hertz.b),
                ("pressure", patch.pressure_max_mpa, hertz.pressure_max),
            ] {
                assert!(
                    (found / expected - 1.0).abs() < 0.005,
                    "radius {radius} mm, {name}: {found} instead of {expected}"
                );
            }
        }
        let grids = solution.normal.expect("a report").grids;
        assert_eq!(grids, if radius < 10.0 { 2 } else { 1 }, "{radius}");
        // Pressure remarks are expected: a steel body of 1 mm radius would yield.
        let pressures = ["pressure-implausible", "pressure-above-shakedown"];
        let other = |remark: &&RemarkEntry| !pressures.contains(&remark.code.as_str());
        let others: Vec<_> = solution.remarks.iter().filter(other).collect();
        assert!(others.is_empty(), "{others:?}");
    }
}
