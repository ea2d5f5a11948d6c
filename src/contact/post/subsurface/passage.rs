//! What a point of a body lives through while a contact in steady rolling passes over it: the stresses on a line along x, and none
//! before and after.
//!
//! Dang Van's criterion (Dang Van, Cailletaud, Flavenot, Le Douaron, Lieurade 1989): a grain shakes down to the residual stress
//! in the centre of the smallest ball about the stress deviators; what decides is the largest over time of half of Tresca's stress of what is
//! left, plus the hydrostatic stress times a slope.
//!
//! Shakedown by the theorem of Melan (Johnson 1985, section 9.2): yielding ends if some residual stress, constant in time, keeps the
//! stresses below yield. What is the same all along the rolling direction and across, as a body keeps it that is rolled over
//! everywhere, has only σ_xx, σ_yy and σ_xy. Each depth is judged by itself.

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

use crate::contact::half_space::kernels::Stress;
use crate::contact::post::subsurface::states::principal;
use crate::contact::post::subsurface::worst::{Deviator, enclosing_ball};

/// Weights of points that hold the ball, from which on the places beside them are looked at. Chosen by judgement.
const HOLDING: f64 = 0.02;

/// What is judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PassageMeasure {
    /// Dang Van's stress with the weight of the hydrostatic stress.
    DangVan(f64),
    /// The yield stress in shear that elastic shakedown needs.
    Shakedown,
}

/// The largest stress of a passage.
#[derive(Debug, Clone, PartialEq)]
pub struct PassageValue {
    /// In the unit of the stresses.
    pub stress: f64,
    /// States that decide it.
    pub deciding: Vec<usize>,
    /// What is left of the search for the smallest ball: see [`EnclosingBall`](crate::contact::post::subsurface::worst::EnclosingBall).
    pub gap: f64,
}

/// What stresses on a line along x amount to; the stress-free state before and after is added.
#[must_use]
pub fn judge(measure: PassageMeasure, states: &[Stress]) -> PassageValue {
    let mut points: Vec<Deviator> = states.iter().map(|state| deviator(*state)).collect();
    points.push([0.0; 5]);
    let free = match measure {
        PassageMeasure::DangVan(_) => 5,
        PassageMeasure::Shakedown => 3,
    };
    let ball = enclosing_ball(&points, free);
    let mut deciding: Vec<usize> = (0..states.len())
        .filter(|k| ball.weights[*k] > HOLDING)
        .collect();
    let PassageMeasure::DangVan(slope) = measure else {
        return PassageValue {
            stress: FRAC_1_SQRT_2 * ball.radius,
            deciding,
            gap: ball.gap,
        };
    };
    let hydrostatic = |k: usize| {
        let state = states.get(k).copied().unwrap_or_default();
        (state[0] + state[1] + state[2]) / 3.0
    };
    let stresses = points.iter().enumerate().map(|(k, point)| {
        let left = std::array::from_fn(|c| point[c] - ball.centre[c]);
        let [first, _, third] = principal(tensor(left)).stress;
        (k, 0.5 * (first - third) + slope * hydrostatic(k))
    });
    let largest = stresses.max_by(|a, b| a.1.total_cmp(&b.1));
    let (at, stress) = largest.unwrap_or((states.len(), 0.0));
    if at < states.len() && !deciding.contains(&at) {
        deciding.push(at);
    }
    PassageValue {
        stress,
        deciding,
        gap: ball.gap,
    }
}

/// First the coordinates that residual stresses change, then those of the shears σ_xz and σ_yz.
fn deviator([xx, yy, zz, xy, xz, yz]: Stress) -> Deviator {
    let out = (2.0 * zz - xx - yy) / 6_f64.sqrt();
    [
        FRAC_1_SQRT_2 * (xx - yy),
        out,
        SQRT_2 * xy,
        SQRT_2 * xz,
        SQRT_2 * yz,
    ]
}

/// The tensor of a deviator.
fn tensor([apart, out, xy, xz, yz]: Deviator) -> Stress {
    let half = FRAC_1_SQRT_2;
    let out = out / 6_f64.sqrt();
    [
        half * apart - out,
        -half * apart - out,
        2.0 * out,
        half * xy,
        half * xz,
        half * yz,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dang_van(states: &[Stress]) -> f64 {
        judge(PassageMeasure::DangVan(0.3), states).stress
    }

    /// Rotating bending S: S/2 + slope S/3; torsion T: T; tension from 0 to S: S/4 + slope S/3; a pressure to and fro: nothing from shear.
    #[test]
    fn tension_and_torsion_give_what_the_criterion_says() {
        let tension = |s: f64| [s, 0.0, 0.0, 0.0, 0.0, 0.0];
        let torsion = |t: f64| [0.0, 0.0, 0.0, 0.0, t, 0.0];
        let close =
            |found: f64, known: f64| assert!((found - known).abs() < 1e-4, "{found} {known}");
        close(dang_van(&[tension(60.0), tension(-60.0)]), 36.0);
        close(dang_van(&[torsion(50.0), torsion(-50.0)]), 50.0);
        close(dang_van(&[tension(60.0)]), 21.0);
        close(dang_van(&[[-40.0, -40.0, -40.0, 0.0, 0.0, 0.0]]), 0.0);
    }
}
