//! The worst lines along x below a patch for a passage of the contact.
//!
//! While a contact in steady rolling passes over a point of a body, the point has the stresses on a line along x, and none before and after. The worst
//! line is found by a scan over y and depth, and a search in `(y/b, ln depth)` with additional states next to the decisive ones.
//!
//! **Dang Van's criterion** (Dang Van, Cailletaud, Flavenot, Le Douaron, Lieurade 1989): a grain shakes down to the residual stress in the centre of the
//! smallest ball that encloses the stress deviators. The criterion is the largest value over time of half of Tresca's stress of the remaining
//! deviator, plus the hydrostatic stress times a slope.
//!
//! **Shakedown by the theorem of Melan** (Johnson 1985, section 9.2): yielding ends if some residual stress, constant in time, keeps the stresses below
//! yield. In a body that is rolled over everywhere, the residual stress does not depend on x and y, and has only σ_xx, σ_yy and σ_xy. Each depth is
//! assessed separately.

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

use crate::case::words::subsurface::PassageWords;
use crate::half_space::kernels::Stress;
use crate::monitor::{Monitor, Stop};
use crate::numerics::roots::bounds;
use crate::post::subsurface::load_parts::LoadResolution;
use crate::post::subsurface::states::{principal, von_mises};
use crate::post::subsurface::surface_load::LoadWorkspace;
use crate::post::subsurface::worst::{
    BelowPatch, COLUMNS, DEPTHS, Deviator, HALVINGS, STEPS, climb, enclosing_ball, spread,
};
use crate::solution::words::evolution::{PassagePlace, PassageSummary};

// These constants are chosen by judgement. `cargo test --test physics -- shakes_down` compares the results with closed forms.

/// Number of equally spaced states on each side of the middle.
const NEAR: usize = 16;
/// Position of the outermost of these, relative to the half-length.
const NEAR_REACH: f64 = 1.5;
/// Positions of the states farther out, relative to the half-length.
const FAR: [f64; 4] = [1.8, 2.3, 3.2, 5.0];

/// The worst passages below a patch, and the accuracy of the enclosing balls.
#[derive(Debug, Clone, Copy)]
pub struct JudgedPassage {
    /// The worst of the passages.
    pub summary: PassageSummary,
    /// The largest gap of the balls on the worst lines, see [`enclosing_ball`](crate::post::subsurface::worst).
    pub gap: f64,
}

/// Finds the worst passages below a patch. `worst` is the point `[x, y, depth]` with the largest von Mises stress.
///
/// # Errors
///
/// Returns an error if the monitor stopped the work.
pub fn passage(
    task: PassageWords,
    of: BelowPatch,
    worst: [f64; 3],
    monitor: &dyn Monitor,
) -> Result<JudgedPassage, Stop> {
    let mut measures = vec![PassageMeasure::Shakedown];
    measures.extend(task.dang_van_slope.map(PassageMeasure::DangVan));
    let lines = Lines::new(of);
    let workspace = &mut of.load.workspace();
    let mut starts = vec![(f64::NEG_INFINITY, [0.0; 2]); measures.len()];
    for across in spread(COLUMNS[1]) {
        for depth in DEPTHS {
            monitor.go_on(0.0)?;
            let at = [across, depth.ln()];
            let states = lines.states(&lines.stations, at, LoadResolution::COARSE, workspace);
            let stresses: Vec<Stress> = states.into_iter().map(|(_, state)| state).collect();
            for (start, measure) in starts.iter_mut().zip(&measures) {
                let found = judge(*measure, &stresses).stress;
                if found > start.0 {
                    *start = (found, at);
                }
            }
        }
    }
    let mut found = Vec::with_capacity(measures.len());
    let mut gap = 0.0_f64;
    for (measure, (_, start)) in measures.into_iter().zip(starts) {
        let (place, left) = lines.search(measure, start, workspace, monitor)?;
        found.push(place);
        gap = gap.max(left);
    }
    let stress = of.load.stress(worst, LoadResolution::FINE, workspace);
    let summary = PassageSummary {
        yield_with_residual: found[0],
        dang_van: found.get(1).copied(),
        yield_without_residual: PassagePlace {
            at_mm: [worst[1], worst[2]],
            stress_mpa: von_mises(stress) / 3_f64.sqrt(),
        },
    };
    Ok(JudgedPassage { summary, gap })
}

/// The lines below a patch.
struct Lines<'a> {
    of: BelowPatch<'a>,
    /// x of the states in mm.
    stations: Vec<f64>,
}

impl<'a> Lines<'a> {
    fn new(of: BelowPatch<'a>) -> Lines<'a> {
        let patches = of.footprint.patches().iter();
        let ends = patches.flat_map(|patch| [patch.extent[0], patch.extent[1]]);
        let [first, last] = bounds(ends);
        let (centre, reach) = (0.5 * (first + last), 0.5 * (last - first));
        let inner = (1..=NEAR).map(|k| NEAR_REACH * k as f64 / NEAR as f64);
        let one_side: Vec<f64> = inner.chain(FAR).collect();
        let behind = one_side.iter().rev().map(|s| -s);
        let all = behind.chain([0.0]).chain(one_side.iter().copied());
        Lines {
            stations: all.map(|s| centre + reach * s).collect(),
            of,
        }
    }

    /// x and stress at some x in mm on a line.
    fn states(
        &self,
        stations: &[f64],
        at: [f64; 2],
        resolution: LoadResolution,
        workspace: &mut LoadWorkspace,
    ) -> Vec<(f64, Stress)> {
        let [y, depth] = self.of.place(at);
        let load = self.of.load;
        let state = |x: &f64| (*x, load.stress([*x, y, depth], resolution, workspace));
        stations.iter().map(state).collect()
    }

    /// The measure of one line and the gap of its ball, with states added next to the decisive ones.
    fn value(
        &self,
        measure: PassageMeasure,
        at: [f64; 2],
        workspace: &mut LoadWorkspace,
    ) -> (f64, f64) {
        let mut states = self.states(&self.stations, at, LoadResolution::FINE, workspace);
        let judged = |states: &[(f64, Stress)]| {
            let stresses: Vec<Stress> = states.iter().map(|(_, state)| *state).collect();
            judge(measure, &stresses)
        };
        for _ in 0..HALVINGS {
            let deciding = judged(&states).deciding;
            let before = deciding.iter().filter_map(|k| k.checked_sub(1));
            let mut between: Vec<usize> = deciding.iter().copied().chain(before).collect();
            between.retain(|k| k + 1 < states.len());
            between.sort_unstable();
            between.dedup();
            let between = between.into_iter();
            let added: Vec<f64> = between
                .map(|k| 0.5 * (states[k].0 + states[k + 1].0))
                .collect();
            states.extend(self.states(&added, at, LoadResolution::FINE, workspace));
            states.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        let found = judged(&states);
        (found.stress, found.gap)
    }

    /// Searches for the worst line from a start.
    fn search(
        &self,
        measure: PassageMeasure,
        start: [f64; 2],
        workspace: &mut LoadWorkspace,
        monitor: &dyn Monitor,
    ) -> Result<(PassagePlace, f64), Stop> {
        let (at, (best, gap)) = climb(start, [STEPS[1], STEPS[2]], |at| {
            monitor.go_on(0.0)?;
            Ok(self.value(measure, at, workspace))
        })?;
        let place = PassagePlace {
            at_mm: self.of.place(at),
            stress_mpa: best,
        };
        Ok((place, gap))
    }
}

/// Weight in the enclosing ball from which a state is decisive. Chosen by judgement.
const HOLDING: f64 = 0.02;

/// The criterion for a passage.
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
    /// The largest stress, in the unit of the stresses.
    pub stress: f64,
    /// Indices of the decisive states.
    pub deciding: Vec<usize>,
    /// Duality gap of the smallest enclosing ball; see [`EnclosingBall`](crate::post::subsurface::worst::EnclosingBall).
    pub gap: f64,
}

/// Assesses the stresses on a line along x. The stress-free state before and after the contact is added.
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

/// The deviator of a stress. The coordinates that residual stresses change come first, then those of the shear stresses σ_xz and σ_yz.
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
mod passage_tests {
    use super::*;

    fn dang_van(states: &[Stress]) -> f64 {
        judge(PassageMeasure::DangVan(0.3), states).stress
    }

    /// Rotating bending S gives S/2 + slope S/3, torsion T gives T, tension from 0 to S gives S/4 + slope S/3. A hydrostatic pressure has no shear.
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
