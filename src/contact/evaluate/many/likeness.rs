//! Which rows ask the same but for their motions, and what turns the answer to one of them into that to another.

use std::f64::consts::PI;

use crate::contact::evaluate::many_answer::{Found, NUMBER_NAMES, NumberColumns};
use crate::contact::normal::hertz::Ellipse;
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::problem::physics::{Problem, RowMotion};
use crate::contact::rolling::motion::Motion;

/// Ratios of semi-axes of similar ellipses agree so well. Numeric safety: those of equal radii differ by rounding.
const SAME_RATIO: f64 = 1e-12;

/// A row relative to the head of its group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Likeness {
    /// The same footprint, friction and bodies.
    Same,
    /// Similar ellipses under one coefficient of friction: what is dimensionless is the same.
    Similar(Similar),
}

/// An ellipse relative to a similar one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Similar {
    ellipse: Ellipse,
    /// Its length over that of the other.
    length: f64,
    /// Its tangential forces over those of the other.
    force: f64,
    /// Its tractions over those of the other; creepages are in the same ratio.
    traction: f64,
}

impl Likeness {
    /// How a row is like the head of a group, if it is.
    pub(crate) fn of(row: &CheckedCase, head: &CheckedCase) -> Option<Likeness> {
        let (asked, of_head) = (&row.problem, &head.problem);
        let alike = row.run == head.run
            && asked.elasticity == of_head.elasticity
            && asked.interface == of_head.interface;
        if !alike {
            return None;
        }
        if let (Some((ellipse, friction)), Some((other, other_friction))) =
            (scalable(asked), scalable(of_head))
        {
            let [ratio, of_other] = [ellipse, other].map(|of| of.a / of.b);
            let similar = || Similar::of(ellipse, friction, other, other_friction);
            return ((ratio / of_other - 1.0).abs() <= SAME_RATIO)
                .then(|| Likeness::Similar(similar()));
        }
        let same = asked.task == of_head.task && asked.friction == of_head.friction;
        same.then_some(Likeness::Same)
    }

    /// The motion of the row as the head would make it.
    pub(crate) fn motion(self, row: RowMotion) -> RowMotion {
        let Likeness::Similar(similar) = self else {
            return row;
        };
        let Motion {
            creepage_x,
            creepage_y,
            spin_per_mm,
        } = row.motion;
        let Similar {
            length,
            force,
            traction,
            ..
        } = similar;
        RowMotion {
            motion: Motion {
                creepage_x: creepage_x / traction,
                creepage_y: creepage_y / traction,
                spin_per_mm: spin_per_mm * length / traction,
            },
            forces: row.forces.map(|given| given.map(|given| given / force)),
            speed: row.speed,
        }
    }

    /// Makes numbers of the head those of the row; only the table has derivatives, and its rows have no meshes.
    pub(crate) fn numbers(self, columns: &NumberColumns, numbers: &mut [f64]) {
        let Likeness::Similar(similar) = self else {
            return;
        };
        let Similar {
            ellipse,
            length,
            force,
            traction,
        } = similar;
        let moment = force * length;
        let (fixed, found) = numbers.split_at_mut(NUMBER_NAMES.len());
        fixed[0] = ellipse.normal_force;
        let of_forces = [force, force, moment, force, moment, force * traction];
        for (number, factor) in fixed[1..].iter_mut().zip(of_forces) {
            *number *= factor;
        }
        fixed[8] = PI * ellipse.a * ellipse.b;
        fixed[9] = ellipse.pressure_max;
        for (number, found) in found.iter_mut().zip(&columns.found) {
            if matches!(found, Found::CreepageX | Found::CreepageY) {
                *number *= traction;
            }
        }
    }
}

impl Similar {
    fn of(ellipse: Ellipse, friction: f64, other: Ellipse, other_friction: f64) -> Similar {
        let length = (ellipse.a / other.a * (ellipse.b / other.b)).sqrt();
        let force = ellipse.normal_force / other.normal_force * (friction / other_friction);
        Similar {
            ellipse,
            length,
            force,
            traction: force / (length * length),
        }
    }
}

/// The ellipse and the coefficient of friction of a question whose answer scales with them. The slip that pressure gives bodies of unlike material
/// does not scale with the coefficient.
fn scalable(problem: &Problem) -> Option<(Ellipse, f64)> {
    let plain = problem.plain()?;
    let scales = plain.coefficient > 0.0 && problem.elasticity.difference == 0.0;
    scales.then_some((plain.ellipse, plain.coefficient))
}
