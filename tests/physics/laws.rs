//! Tests of exact laws that hold in theory and on every symmetric mesh: symmetry, scaling, friction, power.

use railhead_contact::solution::words::answer::{Fields, PatchCells, Zone};

use crate::reference::{Ellipse, assert_none, solve};

/// Allowed residual of a converged iteration, relative to μN, μN√(ab) or the largest friction bound.
const SOLVER: f64 = 1e-6;

/// Motions in dimensionless form: creepage alone, spin alone, both; stick, partial slip, nearly full slip.
pub const MOTIONS: [[f64; 3]; 7] = [
    [0.3, 0.0, 0.0],
    [0.0, 0.8, 0.0],
    [0.6, -0.3, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, 6.0],
    [0.5, 0.2, 1.5],
    [-1.5, 2.0, 3.0],
];

pub fn shapes() -> impl Iterator<Item = Ellipse> {
    [(0.3, 0.28), (1.0, 0.0), (1.0, 0.28), (2.5, 0.45)]
        .into_iter()
        .map(|(a_over_b, nu)| Ellipse::steel(a_over_b, nu))
}

fn every_case() -> impl Iterator<Item = (Ellipse, [f64; 3])> {
    shapes().flat_map(|steel| MOTIONS.map(|m| (steel, m)))
}

fn close(name: &str, left: [f64; 3], right: [f64; 3], tolerance: f64) {
    for k in 0..3 {
        assert!(
            (left[k] - right[k]).abs() <= tolerance,
            "{name}: {left:?} and {right:?}"
        );
    }
}

fn tractions(fields: &Fields) -> (&PatchCells, &[f64], &[f64]) {
    let patch = &fields.patches[0];
    let point = &patch.points[0];
    (
        patch.cells(0),
        point.traction_x_mpa.as_ref().unwrap(),
        point.traction_y_mpa.as_ref().unwrap(),
    )
}

#[test]
fn reversed_motion_reverses_forces_and_tractions() {
    for (steel, [x, y, spin]) in every_case() {
        let there = steel.normalised(x, y, spin);
        let back = steel.normalised(-x, -y, -spin);
        let (solution, fields) = solve(&there.case(12, 12));
        let (reversed, reversed_fields) = solve(&back.case(12, 12));
        let forces = there.relative(&solution.patches[0].points[0]);
        let negative = back.relative(&reversed.patches[0].points[0]).map(|f| -f);
        close("reversed", forces, negative, SOLVER);
        let ((_, tx, ty), (_, rx, ry)) = (tractions(&fields), tractions(&reversed_fields));
        let bound = steel.friction * steel.pressure_max();
        for i in 0..tx.len() {
            assert!(
                (tx[i] + rx[i]).abs() + (ty[i] + ry[i]).abs() < 10.0 * SOLVER * bound,
                "cell {i} of {there:?}"
            );
        }
    }
}

#[test]
fn mirrored_motion_mirrors_forces_and_tractions() {
    for (steel, [x, y, spin]) in every_case() {
        let right = steel.normalised(x, y, spin);
        let left = steel.normalised(x, -y, -spin);
        let (solution, fields) = solve(&right.case(12, 10));
        let (mirrored, mirrored_fields) = solve(&left.case(12, 10));
        let [fx, fy, mz] = left.relative(&mirrored.patches[0].points[0]);
        close(
            "mirrored",
            right.relative(&solution.patches[0].points[0]),
            [fx, -fy, -mz],
            SOLVER,
        );
        let ((patch, tx, ty), (_, mx, my)) = (tractions(&fields), tractions(&mirrored_fields));
        let bound = steel.friction * steel.pressure_max();
        for i in 0..tx.len() {
            // Strip j of 12 lies opposite strip 11 − j, with the same order of cells.
            let image = (11 - i / 10) * 10 + i % 10;
            assert!((patch.y_mm[i] + patch.y_mm[image]).abs() < 1e-9 * steel.b_mm);
            assert!(
                (tx[i] - mx[image]).abs() + (ty[i] + my[image]).abs() < 10.0 * SOLVER * bound,
                "cell {i} of {right:?}"
            );
        }
    }
}

#[test]
fn reversing_only_the_longitudinal_creepage_reverses_only_its_force() {
    for (steel, [x, y, spin]) in every_case() {
        let [fx, fy, mz] = steel.normalised(-x, y, spin).forces(12, 12);
        close(
            "reversed ν_x",
            steel.normalised(x, y, spin).forces(12, 12),
            [-fx, fy, mz],
            SOLVER,
        );
    }
}

#[test]
fn symmetry_leaves_no_forces_across_and_none_along() {
    for steel in shapes() {
        let [_, fy, mz] = steel.normalised(0.7, 0.0, 0.0).forces(11, 12);
        assert!(fy.abs() < SOLVER && mz.abs() < SOLVER, "{fy} {mz}");
        let [fx, _, _] = steel.normalised(0.0, 0.7, 2.0).forces(11, 12);
        assert!(fx.abs() < SOLVER, "{fx}");
    }
}

#[test]
fn rolling_forward_is_not_rolling_backward() {
    // There is no symmetry x → −x: the tractions are larger toward the trailing edge.
    let steel = Ellipse::steel(1.0, 0.28);
    let (_, fields) = solve(&steel.normalised(0.2, 0.0, 0.0).case(12, 12));
    let (patch, tx, _) = tractions(&fields);
    let moment: f64 = (0..tx.len())
        .map(|i| patch.x_mm[i] * tx[i] * patch.dx_mm[i] * patch.dy_mm[i])
        .sum();
    assert!(moment < -0.02 * steel.limit() * steel.c(), "{moment}");
}

#[test]
fn units_and_lengths_do_not_matter() {
    let mut failures = Vec::new();
    for (steel, [x, y, spin]) in every_case() {
        let base = steel.normalised(x, y, spin);
        let forces = base.forces(10, 12);
        let [vx, vy, phi] = base.motion;
        // Metres and Pa would exceed the largest modulus that a case may have.
        let centimetres = Ellipse {
            a_mm: base.a_mm * 0.1,
            b_mm: base.b_mm * 0.1,
            shear_modulus_mpa: base.shear_modulus_mpa * 100.0,
            motion: [vx, vy, phi * 10.0],
            ..base
        };
        let longer = Ellipse {
            a_mm: base.a_mm * 3.0,
            b_mm: base.b_mm * 3.0,
            normal_force_n: base.normal_force_n * 9.0,
            motion: [vx, vy, phi / 3.0],
            ..base
        };
        let softer = Ellipse {
            shear_modulus_mpa: base.shear_modulus_mpa / 7.0,
            normal_force_n: base.normal_force_n / 7.0,
            ..base
        };
        let rougher = Ellipse {
            friction: base.friction * 1.7,
            motion: base.motion.map(|v| v * 1.7),
            ..base
        };
        for (name, other) in [
            ("centimetres", centimetres),
            ("longer", longer),
            ("softer", softer),
            ("rougher", rougher),
        ] {
            let scaled = other.forces(10, 12);
            if (0..3).any(|k| (scaled[k] - forces[k]).abs() > SOLVER) {
                failures.push(format!(
                    "{name}: {scaled:?} instead of {forces:?} for {base:?}"
                ));
            }
        }
    }
    assert_none("relative forces changed with the scale", &failures);
}

#[test]
fn zones_fill_the_patch_and_stick_touches_the_leading_edge() {
    for steel in shapes() {
        let (solution, fields) = solve(&steel.normalised(0.4, 0.0, 0.0).case(12, 12));
        let point = &solution.patches[0].points[0];
        let (stick, slip) = (point.stick_area_mm2.unwrap(), point.slip_area_mm2.unwrap());
        let patch = &fields.patches[0];
        let whole = solution.patches[0].area_mm2;
        assert!(
            (stick + slip - whole).abs() < 1e-9 * whole,
            "{stick} + {slip} is not {whole}"
        );
        assert!(
            stick > 0.05 * whole && slip > 0.05 * whole,
            "{stick} {slip}"
        );
        let zone = patch.points[0].zone.as_ref().unwrap();
        // In the two middle strips: slip at the trailing end, stick at the leading end.
        for strip in [5, 6] {
            assert_eq!(
                (zone[strip * 12], zone[strip * 12 + 11]),
                (Zone::Slip, Zone::Stick)
            );
        }
    }
}

#[test]
fn full_slip_carries_friction_times_load_along_the_creepage() {
    for steel in shapes() {
        // Little friction replaces large creepage: the same dimensionless motion, with creepages that occur in practice.
        let steel = Ellipse {
            friction: 1e-5,
            ..steel
        };
        for angle in [0.0f64, 0.7, 2.1, -1.2] {
            let [fx, fy, _] = steel
                .normalised(1e5 * angle.cos(), 1e5 * angle.sin(), 0.0)
                .forces(12, 12);
            assert!(
                (fx - angle.cos()).abs() < 1e-4 && (fy - angle.sin()).abs() < 1e-4,
                "{fx} {fy} at {angle}"
            );
            assert!((fx.hypot(fy) - 1.0).abs() < 1e-6, "{}", fx.hypot(fy));
        }
    }
}

#[test]
fn pure_spin_tends_to_the_moment_of_a_spinning_pressure() {
    // Johnson 1985, ch. 8: M = (3/8) μN·(larger semi-axis)·E(m), m = 1 − (smaller/larger)².
    for (a_over_b, factor) in [
        (1.0, 0.589049),
        (0.5, 0.454146),
        (2.0, 0.454146),
        (0.25, 0.402114),
        (4.0, 0.402114),
    ] {
        let steel = Ellipse {
            friction: 1e-5,
            ..Ellipse::steel(a_over_b, 0.28)
        };
        let contact = steel.normalised(0.0, 0.0, 1e5);
        let [fx, fy, mz] = contact.forces(16, 16);
        let moment = mz * contact.c() / contact.a_mm.max(contact.b_mm);
        assert!(
            (moment / factor - 1.0).abs() < 0.005,
            "a/b {a_over_b}: {moment} instead of {factor}"
        );
        assert!(
            fx.abs() < SOLVER && fy.abs() < 1e-3,
            "a/b {a_over_b}: {fx} {fy}"
        );
    }
}

#[test]
fn friction_power_is_that_of_the_resultants_and_never_negative() {
    for (steel, [x, y, spin]) in every_case() {
        let contact = steel.normalised(x, y, spin);
        let (solution, fields) = solve(&contact.case(12, 12));
        let point = &solution.patches[0].points[0];
        let [vx, vy, phi] = contact.motion;
        let power = vx * point.force_x_n + vy * point.force_y_n + phi * point.moment_z_n_mm;
        assert!(
            (point.friction_power_n - power).abs() <= 1e-12 * power.abs(),
            "{} {power}",
            point.friction_power_n
        );
        assert!(power > 0.0);
        let without_spin = (vx * point.force_x_n).abs() + (vy * point.force_y_n).abs();
        assert!((point.friction_power_without_spin_n - without_spin).abs() <= 1e-12 * without_spin);

        let (patch, tx, ty) = tractions(&fields);
        let sum = |f: &dyn Fn(usize) -> f64| -> f64 {
            (0..tx.len())
                .map(|i| f(i) * patch.dx_mm[i] * patch.dy_mm[i])
                .sum()
        };
        let by_cells = [
            sum(&|i| tx[i]),
            sum(&|i| ty[i]),
            sum(&|i| patch.x_mm[i] * ty[i] - patch.y_mm[i] * tx[i]),
        ];
        let (limit, c) = (contact.limit(), contact.c());
        let relative = [
            by_cells[0] / limit,
            by_cells[1] / limit,
            by_cells[2] / (limit * c),
        ];
        close(
            "sums over the cells",
            contact.relative(point),
            relative,
            SOLVER,
        );
    }
}

#[test]
fn no_friction_and_no_motion_give_no_force() {
    let steel = Ellipse::steel(1.0, 0.28);
    let frictionless = Ellipse {
        friction: 0.0,
        ..steel.moving(1e-3, 1e-3, 1e-4)
    };
    for contact in [steel, frictionless] {
        let (solution, _) = solve(&contact.case(8, 8));
        let point = &solution.patches[0].points[0];
        assert_eq!(
            [point.force_x_n, point.force_y_n, point.moment_z_n_mm],
            [0.0; 3]
        );
        assert_eq!(point.friction_power_n, 0.0);
    }
}
