//! Tests the limit of a very wide patch: every strip is Carter's line contact.

use railhead_contact::solution::words::answer::{Fields, PatchFields};

use crate::reference::{Ellipse, cases, solve};

/// Half width over half length. End effects decrease with its square.
const WIDE: f64 = 1000.0;
/// The number of strips, which is odd. With few strips the load on an ellipse is too large, so that its correction would lower the bound.
const STRIPS: u32 = 31;

/// Returns Σ T_x dx / (μ Σ p dx) of one strip.
fn strip_force(patch: &PatchFields, strip: u32, friction: f64) -> f64 {
    let traction = patch.points[0].traction_x_mpa.as_ref().unwrap();
    let mesh = patch.cells(0);
    let pressure = mesh.pressure_mpa.as_ref().unwrap();
    let cells = || (0..mesh.strip.len()).filter(|&i| mesh.strip[i] == strip);
    let sum = |values: &[f64]| cells().map(|i| values[i] * mesh.dx_mm[i]).sum::<f64>();
    sum(traction) / (friction * sum(pressure))
}

fn central_strip(contact: &Ellipse, cells: u32) -> f64 {
    let (_, Fields { patches }) = solve(&contact.case(STRIPS, cells));
    strip_force(&patches[0], STRIPS / 2, contact.friction)
}

#[test]
fn central_strip_of_a_very_wide_patch_carries_carters_force() {
    let cases = cases("carter2d");
    assert_eq!(cases.len(), 3);
    for case in cases {
        let b = WIDE * case.a_mm;
        let load =
            case.pressure_max_mpa.unwrap() * 2.0 * std::f64::consts::PI / 3.0 * case.a_mm * b;
        let contact = Ellipse {
            a_mm: case.a_mm,
            b_mm: b,
            normal_force_n: load,
            friction: case.friction,
            shear_modulus_mpa: case.shear_modulus_mpa,
            poisson_ratio: case.poisson_ratio,
            motion: [case.creepage_x, case.creepage_y, case.spin_per_mm],
        };
        let exact = case.carter_force_x.unwrap();
        assert!((case.force_x.value - exact).abs() <= case.force_x.unc);
        let [coarse, middle, fine] =
            [8, 16, 32].map(|cells| (central_strip(&contact, cells) - exact).abs());
        println!(
            "{}: off by {coarse:.5}, {middle:.5}, {fine:.5} with 8, 16, 32 cells",
            case.id
        );
        assert!(
            middle < 0.002 + case.force_x.unc,
            "{}: {middle:.5} with 16 cells",
            case.id
        );
        assert!(
            fine < 0.001 + case.force_x.unc,
            "{}: {fine:.5} with 32 cells",
            case.id
        );
        assert!(
            fine < coarse,
            "{}: {coarse:.5} with 8 cells, {fine:.5} with 32",
            case.id
        );
    }
}
