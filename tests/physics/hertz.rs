//! Tests of Hertz's contact: worked cases of the literature and the scaling laws.

use railhead_contact::case::solver::Limits;
use railhead_contact::check;
use railhead_contact::normal::hertz::{Ellipse, NormalLoad};
use serde_json::json;

/// A worked case: bodies, load and expected results.
struct Worked {
    contact_modulus: f64,
    radii: [f64; 2],
    force: f64,
    semi_axes: [f64; 2],
    pressure_max: f64,
    approach: f64,
}

fn modulus_from_young(young: f64, poisson: f64) -> f64 {
    young / (2.0 * (1.0 - poisson * poisson))
}

/// Returns worked cases with as many digits as the source prints. Cases (1) and (2) have the parameters of CONTACT's examples `fastsim` and
/// `cattaneo`, whose boundary-element answers are p0 = 1223 MPa, δ = 0.09266 mm and p0 = 4.393 MPa, δ = 0.01998 mm. Cases (3) and (4) are a wheel on
/// a rail crown, and a crown in a concave wheel, computed with 20 digits after Johnson.
fn worked_cases() -> [Worked; 4] {
    [
        Worked {
            contact_modulus: 82_000.0 / 0.72,
            radii: [0.5 / 0.8464e-3, 0.5 / 2.406e-3],
            force: 82_000.0,
            semi_axes: [8.000, 4.000],
            pressure_max: 1223.46,
            approach: 0.092668,
        },
        Worked {
            contact_modulus: 200.0 / 0.58,
            radii: [50.0, 50.0],
            force: 9.1954,
            semi_axes: [1.0, 1.0],
            pressure_max: 4.3905,
            approach: 0.02,
        },
        Worked {
            contact_modulus: modulus_from_young(210_000.0, 0.3),
            radii: [460.0, 300.0],
            force: 80_000.0,
            semi_axes: [6.6483, 5.0010],
            pressure_max: 1148.85,
            approach: 0.089727,
        },
        Worked {
            contact_modulus: modulus_from_young(210_000.0, 0.3),
            radii: [460.0, 1.0 / (1.0 / 300.0 - 1.0 / 330.0)],
            force: 100_000.0,
            semi_axes: [4.6317, 16.880],
            pressure_max: 610.69,
            approach: 0.066492,
        },
    ]
}

fn close(left: f64, right: f64, relative: f64) -> bool {
    (left - right).abs() <= relative * right.abs()
}

#[test]
fn worked_cases_come_out() {
    for case in worked_cases() {
        let [rolling, lateral] = case.radii;
        let ellipse = Ellipse::of_radii(
            rolling,
            lateral,
            NormalLoad::Force(case.force),
            case.contact_modulus,
        );
        let within = 1e-4; // The inputs A and B of the first case are printed with four digits.
        assert!(close(ellipse.a, case.semi_axes[0], within), "{ellipse:?}");
        assert!(close(ellipse.b, case.semi_axes[1], within), "{ellipse:?}");
        assert!(
            close(ellipse.pressure_max, case.pressure_max, within),
            "{ellipse:?}"
        );
        assert!(
            close(ellipse.approach, case.approach, within),
            "{ellipse:?}"
        );
    }
}

#[test]
fn the_ellipse_fits_the_gap_it_was_made_from() {
    // Inside the contact the displacement is δ − h(x, y). The test computes its value and curvatures at the centre by quadrature, independently of
    // the elliptic integrals.
    for (rolling, lateral) in [(460.0, 300.0), (300.0, 300.0), (100.0, 3000.0)] {
        let modulus = 1.0e5;
        let ellipse = Ellipse::of_radii(rolling, lateral, NormalLoad::Force(1e5), modulus);
        let (a, b) = (ellipse.a, ellipse.b);
        // u(x, y) = p0 ab/(2E*) ∫_0^∞ (1 − x²/(a²+w) − y²/(b²+w)) dw/√((a²+w)(b²+w)w)   (Johnson 1985, eq. 3.57)
        let integral = |f: &dyn Fn(f64) -> f64| -> f64 {
            // w = e^t; the trapezoid rule converges exponentially.
            (-4000..4000)
                .map(|n| {
                    let w = (0.02 * f64::from(n)).exp();
                    0.02 * w * f(w) / ((a * a + w) * (b * b + w) * w).sqrt()
                })
                .sum()
        };
        let scale = 0.5 * ellipse.pressure_max * a * b / modulus;
        assert!(close(scale * integral(&|_| 1.0), ellipse.approach, 1e-9));
        assert!(close(
            scale * integral(&|w| 1.0 / (a * a + w)),
            0.5 / rolling,
            1e-9
        ));
        assert!(close(
            scale * integral(&|w| 1.0 / (b * b + w)),
            0.5 / lateral,
            1e-9
        ));
    }
}

#[test]
fn force_and_approach_are_inverse_to_each_other() {
    for exponent in -6..=6 {
        let lateral = 300.0 * 10.0_f64.powi(exponent);
        let forward = Ellipse::of_radii(300.0, lateral, NormalLoad::Force(1e5), 1e5);
        let back = Ellipse::of_radii(300.0, lateral, NormalLoad::Approach(forward.approach), 1e5);
        let again = Ellipse::of_semi_axes(
            forward.a,
            forward.b,
            NormalLoad::Approach(forward.approach),
            1e5,
        );
        assert!(close(back.patch().normal_force, 1e5, 1e-12));
        assert!(close(again.patch().normal_force, 1e5, 1e-12));
        assert!(close(back.a, forward.a, 1e-12) && close(back.b, forward.b, 1e-12));
    }
}

#[test]
fn lengths_and_pressure_grow_with_the_cube_root_of_the_load() {
    let at = |force| Ellipse::of_radii(460.0, 300.0, NormalLoad::Force(force), 1.1e5);
    let (one, eight) = (at(1e4), at(8e4));
    assert!(close(eight.a, 2.0 * one.a, 1e-13) && close(eight.b, 2.0 * one.b, 1e-13));
    assert!(close(eight.pressure_max, 2.0 * one.pressure_max, 1e-13));
    assert!(close(eight.approach, 4.0 * one.approach, 1e-13));
}

#[test]
fn doubling_all_lengths_at_fixed_pressure_takes_four_times_the_force() {
    let one = Ellipse::of_radii(460.0, 300.0, NormalLoad::Force(1e5), 1.1e5);
    let two = Ellipse::of_radii(920.0, 600.0, NormalLoad::Force(4e5), 1.1e5);
    assert!(close(two.pressure_max, one.pressure_max, 1e-13));
    assert!(close(two.a, 2.0 * one.a, 1e-13) && close(two.approach, 2.0 * one.approach, 1e-13));
}

#[test]
fn exchanging_the_radii_exchanges_the_semi_axes() {
    let one = Ellipse::of_radii(460.0, 80.0, NormalLoad::Force(1e5), 1.1e5);
    let other = Ellipse::of_radii(80.0, 460.0, NormalLoad::Force(1e5), 1.1e5);
    assert_eq!([one.a, one.b], [other.b, other.a]);
    assert!(close(one.approach, other.approach, 1e-15));
    assert!(one.a > one.b);
}

#[test]
fn a_slender_contact_tends_to_the_line_contact() {
    // a = 1, R = 500, G = 82000, ν = 0.28: 178.90 N/mm and p0 = 113.89 MPa (CONTACT user guide, Carter's example).
    let ellipse = Ellipse::of_radii(500.0, 5e8, NormalLoad::Force(1e5), 82_000.0 / 0.72);
    let per_width = std::f64::consts::PI * ellipse.a.powi(2) * 82_000.0 / (4.0 * 500.0 * 0.72);
    let at_centre = ellipse.pressure_max * std::f64::consts::PI * ellipse.a / 2.0;
    assert!(close(at_centre, per_width, 1e-4), "{at_centre} {per_width}");
    assert!(close(
        std::f64::consts::PI * 82_000.0 / (4.0 * 500.0 * 0.72),
        178.90,
        1e-4
    ));
}

#[test]
fn a_case_of_radii_becomes_the_worked_ellipse() {
    let case = json!({
        "material": { "young_modulus_mpa": 210_000, "poisson_ratio": 0.3 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": 80_000 },
        "motion": { "creepage_x": 0.001 },
    });
    let checked = check(&case, &Limits::default()).unwrap();
    let patch = checked.problem.task.known_patches().expect("known")[0];
    assert!(close(patch.normal_force, 80_000.0, 1e-13));
    assert!(close(patch.pressure_max, 1148.85, 1e-5));
    assert!(close(patch.approach.unwrap(), 0.089727, 1e-5));
    let [a, b] = patch.semi_axes.unwrap();
    assert!(close(a, 6.6483, 1e-5) && close(b, 5.0010, 1e-5));
}
