//! Tests of prescribed forces against CONTACT: the creepages that give them, and the resulting moment.

use serde::Deserialize;
use serde_json::{Value, json};

use crate::reference::{Converged, SolvedEllipse, assert_none, read, solve};

/// Allowed error of a force relative to the friction limit, and of the moment relative to the friction limit times √(ab).
const ALLOWED: f64 = 0.01;

/// A reference contact with prescribed forces. Forces are over the friction limit, the moment over the friction limit times √(ab).
#[derive(Debug, Deserialize)]
struct Reference {
    #[serde(flatten)]
    contact: SolvedEllipse,
    forces: [f64; 2],
    spin_per_mm: f64,
    creepages: [Converged; 2],
    moment: Converged,
}

impl Reference {
    /// Returns F_x, F_y and M_z over their scales, and both creepages.
    fn answer(&self, motion: &Value) -> ([f64; 3], [f64; 2]) {
        let (solution, _) = solve(&self.contact.case(motion));
        let point = &solution.patches[0].points[0];
        let creepages = [point.motion.creepage_x, point.motion.creepage_y];
        (self.contact.relative(point), creepages)
    }
}

/// Tests at default settings that the forces are met, that the moment is CONTACT's, and that CONTACT's creepages give the forces.
#[test]
fn prescribed_forces_agree_with_contact() {
    let all: Vec<Reference> = read("prescribed_forces.json");
    let mut failures = Vec::new();
    for reference in &all {
        let limit = reference.contact.limit();
        let [x, y] = reference.forces;
        let spin = reference.spin_per_mm;
        let (found, creepages) = reference.answer(
            &json!({ "force_x_n": x * limit, "force_y_n": y * limit, "spin_per_mm": spin }),
        );
        let missed = (found[0] - x).hypot(found[1] - y);
        let moment = (found[2] - reference.moment.value).abs() - reference.moment.unc;
        let [known_x, known_y] = reference.creepages.map(|creepage| creepage.value);
        let (back, _) = reference
            .answer(&json!({ "creepage_x": known_x, "creepage_y": known_y, "spin_per_mm": spin }));
        let forces = (back[0] - x).abs().max((back[1] - y).abs());
        // Relative to the size of both creepages: without a force along x the creepage along x is 0.
        let size = known_x.hypot(known_y);
        let off = (0..2).map(|k| {
            let known = reference.creepages[k];
            ((creepages[k] - known.value).abs() - known.unc).max(0.0) / size
        });
        let creepage = off.fold(0.0, f64::max);
        println!(
            "{}: missed by {missed:.1e}, moment off by {moment:.4}, forces of its creepages by {forces:.4}, creepages by {creepage:.4} of them",
            reference.contact.id
        );
        if missed > 1e-3 || moment > ALLOWED || forces > ALLOWED || creepage > 2.0 * ALLOWED {
            failures.push(reference.contact.id.clone());
        }
    }
    assert_eq!(all.len(), 6);
    assert_none("too far from CONTACT", &failures);
}
