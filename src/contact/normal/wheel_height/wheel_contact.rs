//! A wheel at rest on its rail, and the same wheel corrected to a force nearby.

use std::f64::consts::PI;

use crate::contact::geometry::frame::Frame;
use crate::contact::geometry::local_gap::LocalGap;
use crate::contact::mesh::strips::Chord;
use crate::contact::normal::gap::answer::NormalWork;
use crate::contact::normal::gap::patch_grid::PatchGrid;
use crate::contact::normal::gap::start::GapStart;
use crate::contact::normal::patch::Patch;
use crate::contact::normal::pressure_field::field::PressureField;
use crate::contact::normal::wheel_height::bracket::HeightExit;
use crate::contact::normal::wheel_height::task::Accuracy;
use crate::contact::remark::entry::RemarkEntry;

/// The third that is left, as an error of the load.
const CORRECTED: f64 = 1.0 / 3.0;
/// Coarse gaps of a single patch, whose force grows as Hertz's, are replaced by fine ones when the force is missed by no more than this: the next
/// height misses it by the square of this.
const NEAR_SINGLE: f64 = 0.1;

/// Rounds of Gauss and Seidel for the stiffness of several patches; three tell two patches to a thousandth.
const STIFFNESS_ROUNDS: usize = 3;

/// Gaps of one contact at two heights differ by less than this in the inclination of their frames, in rad. Chosen by judgement: a start that
/// does not suit is found out.
const TURN_MAX: f64 = 0.05;

/// The wheel at rest on its rail.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelContact {
    /// How far the wheel is below first touch, in mm.
    pub lowering: f64,
    /// The force that is prescribed, in N, as it came out at the last height, and its derivative by the lowering.
    pub(crate) found: [f64; 2],
    /// By how much, relatively, the load of region and pressure may differ from the one wanted.
    pub load_error: f64,
    /// By which part the prescribed force was missed at the last height, before the contact was corrected to it.
    pub force_residual: f64,
    /// Height of the wheel's centre over the top of the rail, in mm.
    pub centre: f64,
    /// Heights that were solved.
    pub heights: u32,
    /// What friction was taken to carry, the `friction_share` of the pass.
    pub friction_share: f64,
    /// Was the force met by fine gaps? Then the contact may be corrected to another force nearby.
    pub(crate) met: bool,
    /// The gaps in contact, from smaller to larger y of the track; never empty.
    pub patches: Vec<GapContact>,
    /// Remarks for the answer.
    pub remarks: Vec<RemarkEntry>,
}

/// The contact in one gap: usually one patch, several where they lie near each other.
#[derive(Debug, Clone, PartialEq)]
pub struct GapContact {
    /// Frame of the coordinates, with its origin at the load centre.
    pub frame: Frame,
    /// Deepest overlap of the undeformed bodies in mm.
    pub(crate) approach: f64,
    /// Region and pressure.
    pub field: PressureField,
    /// How it was found.
    pub report: NormalWork,
    /// Remarks for the answer.
    pub remarks: Vec<RemarkEntry>,
    /// What the gap at another height may be solved from.
    pub(crate) start: Option<GapStart>,
}

impl GapContact {
    /// The start for a gap of the same contact at another height, whose deepest overlap is given in mm; nothing if it is another contact.
    pub(crate) fn start_for(&self, gap: &LocalGap, depth: f64) -> Option<Vec<PatchGrid>> {
        let from = [1, 2].map(|k| self.frame.origin[k]);
        let along = self.frame.origin[0] - gap.frame.origin[0];
        let [across, _] = gap.frame.plane().across(from);
        let inside = |axis: &[f64], at: f64| axis.first() < Some(&at) && Some(&at) < axis.last();
        let same = inside(&gap.x, along)
            && inside(&gap.y, across)
            && (self.frame.angle - gap.frame.angle).abs() < TURN_MAX;
        let start = self.start.as_ref().filter(|_| same)?;
        Some(start.at([along, across], depth))
    }

    /// Middle of equally wide strips across a patch in mm, each with its part of the normal force in N.
    pub(crate) fn strip_loads(&self, patch: usize, count: usize) -> Vec<[f64; 2]> {
        let [.., low, high] = self.field.patches()[patch].extent;
        let dy = (high - low) / count as f64;
        let strips: Vec<(f64, f64)> = (0..count)
            .map(|k| (low + dy * (k as f64 + 0.5), dy))
            .collect();
        let chords = self.field.chords(patch, &strips);
        let load = |chord: &Chord| {
            let length = chord.right - chord.left;
            let pressure = self.field.mean_pressure(chord, chord.left, chord.right);
            [chord.y, pressure * length * chord.dy]
        };
        chords.iter().map(load).collect()
    }

    /// Sum of the normal forces in N.
    #[must_use]
    pub fn normal_force(&self) -> f64 {
        let patches = self.field.patches();
        patches.iter().map(|patch| patch.normal_force).sum()
    }

    /// Force per mm of approach of flat punches of the same areas (exact for one circle), divided by `2 E*`.
    pub(crate) fn stiffness(&self) -> f64 {
        let patches = self.field.patches();
        let punch = |(k, patch): (usize, &Patch)| Punch {
            radius: (patch.area / PI).sqrt(),
            at: self.field.load_centre(Some(k)),
        };
        let mut punches: Vec<Punch> = patches.iter().enumerate().map(punch).collect();
        // The order decides what few rounds leave; so a mirror image has the same.
        punches.sort_by(|a, b| b.radius.total_cmp(&a.radius));
        stiffness(&punches)
    }
}

/// A flat circular punch, in mm.
#[derive(Debug, Clone, Copy)]
struct Punch {
    radius: f64,
    at: [f64; 2],
}

impl Punch {
    /// How far another punch is away; never nearer than side by side, since patches are no circles.
    fn apart(&self, other: &Punch) -> f64 {
        let [x, y] = [0, 1].map(|axis| self.at[axis] - other.at[axis]);
        x.hypot(y).max(self.radius + other.radius)
    }
}

/// Force per mm of approach of punches pressed together, divided by `2 E*`. One alone carries `2 E* a` per mm, and lets the surface at the distance r
/// sink by the force over `π E* r` (Boussinesq 1885).
fn stiffness(punches: &[Punch]) -> f64 {
    let mut forces: Vec<f64> = punches.iter().map(|punch| punch.radius).collect();
    let rounds = if punches.len() > 1 {
        STIFFNESS_ROUNDS
    } else {
        0
    };
    for _ in 0..rounds {
        for (k, punch) in punches.iter().enumerate() {
            let others = punches.iter().zip(&forces).enumerate();
            let sunk: f64 = others
                .filter(|(other, _)| *other != k)
                .map(|(_, (other, force))| 2.0 / PI * force / punch.apart(other))
                .sum();
            forces[k] = punch.radius * (1.0 - sunk);
        }
    }
    forces.iter().sum()
}

impl WheelContact {
    /// The wheel at the height where the search ended, corrected to the force that was wanted.
    pub(crate) fn at_rest(mut self, exit: HeightExit, wanted: f64) -> WheelContact {
        let [carried, slope] = self.found;
        // Where the force jumps, its slope says nothing of the height.
        let lower = if exit.converged() {
            (wanted - carried) / slope
        } else {
            0.0
        };
        self.force_residual = exit.missed();
        self.met = exit.converged();
        self.load_error = match exit {
            HeightExit::Jump { .. } => exit.missed(),
            _ => CORRECTED * exit.missed(),
        };
        self.remarks.extend(exit.remark().map(RemarkEntry::from));
        self.correct(wanted / carried, lower);
        self
    }

    /// The same wheel under another force, where both together miss what was solved by no more than the tolerance.
    pub(crate) fn carrying(&self, wanted: f64, tolerance: f64) -> Option<WheelContact> {
        let [carried, slope] = self.found;
        let factor = wanted / carried;
        let missed = self.force_residual + (factor - 1.0).abs();
        (self.met && missed <= tolerance).then(|| {
            let mut wheel = WheelContact {
                force_residual: missed,
                load_error: CORRECTED * missed,
                heights: 0,
                ..self.clone()
            };
            wheel.correct(factor, (wanted - carried) / slope);
            wheel
        })
    }

    /// The start for a gap at another height of the wheel.
    pub(crate) fn start_for(&self, gap: &LocalGap, depth: f64) -> Option<Vec<PatchGrid>> {
        let apart = |known: &&GapContact| (known.frame.rail - gap.frame.rail).abs();
        self.patches
            .iter()
            .min_by(|a, b| apart(a).total_cmp(&apart(b)))?
            .start_for(gap, depth)
    }

    /// Does one patch carry everything?
    pub(crate) fn is_one_patch(&self) -> bool {
        matches!(&self.patches[..], [gap] if gap.field.patches().len() == 1)
    }

    /// Is the force near enough to go on with fine gaps?
    pub(crate) fn is_near(&self, target: f64, accuracy: Accuracy) -> bool {
        let near = if self.is_one_patch() {
            NEAR_SINGLE
        } else {
            accuracy.near()
        };
        (self.found[0] / target - 1.0).abs() <= near
    }

    /// Forces times a factor near 1, and the wheel lower by so much in mm.
    fn correct(&mut self, factor: f64, lower: f64) {
        self.found[0] *= factor;
        self.lowering += lower;
        self.centre -= lower;
        for gap in &mut self.patches {
            let approach = lower * gap.frame.angle.cos();
            gap.approach += approach;
            gap.field = gap.field.clone().corrected(factor, approach);
        }
    }

    /// Vertical part of the normal forces in N.
    #[must_use]
    pub fn vertical_force(&self) -> f64 {
        let part = |gap: &GapContact| gap.normal_force() * gap.frame.angle.cos();
        self.patches.iter().map(part).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_equal_punches_are_as_stiff_as_their_compliances_tell() {
        let (radius, apart) = (4.0, 15.0);
        let punch = |x: f64| Punch {
            radius,
            at: [x, 0.0],
        };
        assert_eq!(stiffness(&[punch(0.0)]), radius);
        let found = stiffness(&[punch(0.0), punch(apart)]);
        let expected = 2.0 * radius / (1.0 + 2.0 / PI * radius / apart);
        assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
    }
}
