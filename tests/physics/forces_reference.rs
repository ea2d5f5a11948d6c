//! Prescribed forces against CONTACT: creepages that give them, and the moment that comes with them.

use serde::Deserialize;
use serde_json::{Value, json};

use crate::reference::{Converged, assert_none, read, solve};

/// What is allowed of a force relative to the friction limit, and of the moment over that and √(ab).
const ALLOWED: f64 = 0.01;

/// A contact solved elsewhere; forces over the friction limit, moment over that and √(ab).
#[derive(Debug, Deserialize)]
struct Reference {
    id: String,
    semi_axes_mm: [f64; 2],
    normal_force_n: f64,
    friction: f64,
    shear_modulus_mpa: f64,
    poisson_ratio: f64,
    forces: [f64; 2],
    spin_per_mm: f64,
    creepages: [Converged; 2],
    moment: Converged,
}

impl Reference {
    fn limit(&self) -> f64 {
        self.friction * self.normal_force_n
    }

    /// F_x, F_y and M_z over their scales, and both creepages.
    fn answer(&self, motion: Value) -> ([f64; 3], [f64; 2]) {
        let [a, b] = self.semi_axes_mm;
        let (solution, _) = solve(&json!({
            "material": { "shear_modulus_mpa": self.shear_modulus_mpa, "poisson_ratio": self.poisson_ratio },
            "friction": { "coefficient": self.friction },
            "contact": { "type": "ellipse", "a_mm": a, "b_mm": b },
            "load": { "normal_force_n": self.normal_force_n },
            "motion": motion,
        }));
        let point = &solution.patches[0].points[0];
        let arm = (a * b).sqrt();
        let forces = [point.force_x_n, point.force_y_n, point.moment_z_n_mm / arm];
        let motion = point.motion;
        (
            forces.map(|force| force / self.limit()),
            [motion.creepage_x, motion.creepage_y],
        )
    }
}

/// At default settings: the forces are met, the moment is CONTACT's, and its creepages give the forces.
#[test]
fn prescribed_forces_agree_with_contact() {
    let all: Vec<Reference> = read("prescribed_forces.json");
    let mut failures = Vec::new();
    for reference in &all {
        let limit = reference.limit();
        let [x, y] = reference.forces;
        let spin = reference.spin_per_mm;
        let (found, creepages) = reference
            .answer(json!({ "force_x_n": x * limit, "force_y_n": y * limit, "spin_per_mm": spin }));
        let missed = (found[0] - x).hypot(found[1] - y);
        let moment = (found[2] - reference.moment.value).abs() - reference.moment.unc;
        let [known_x, known_y] = reference.creepages.map(|creepage| creepage.value);
        let (back, _) = reference
            .answer(json!({ "creepage_x": known_x, "creepage_y": known_y, "spin_per_mm": spin }));
        let forces = (back[0] - x).abs().max((back[1] - y).abs());
        // Over the larger of both: without a force along x the creepage along it is 0.
        let size = known_x.hypot(known_y);
        let off = (0..2).map(|k| {
            let known = reference.creepages[k];
            ((creepages[k] - known.value).abs() - known.unc).max(0.0) / size
        });
        let creepage = off.fold(0.0, f64::max);
        println!(
            "{}: missed by {missed:.1e}, moment off by {moment:.4}, forces of its creepages by {forces:.4}, creepages by {creepage:.4} of them",
            reference.id
        );
        if missed > 1e-3 || moment > ALLOWED || forces > ALLOWED || creepage > 2.0 * ALLOWED {
            failures.push(reference.id.clone());
        }
    }
    assert_eq!(all.len(), 6);
    assert_none("too far from CONTACT", &failures);
}
