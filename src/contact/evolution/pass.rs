//! The wear of both sections in one pass of a state, from its solved contact.

use std::f64::consts::PI;

use crate::case::words::subsurface::DamageModel;
use crate::error::SolveError;
use crate::evolution::section::{add, lengths, smoothed};
use crate::evolution::task::{Evolution, Sections, SolveContext};
use crate::geometry::plane_curve::arc_lengths;
use crate::monitor::Monitor;
use crate::normal::footprint::NormalTask;
use crate::post::local_power::NANOMETRES;
use crate::remark::entry::RemarkEntry;
use crate::solution::words::answer::PatchSolution;
use crate::solution::words::evolution::{StateContact, StatePatch};

/// Wear of one body: of the rail in one pass, of the wheel per mm rolled.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct BodyWear {
    /// Area in mm² that is lost at each point.
    pub(crate) area: Vec<f64>,
    /// Damage at each point.
    pub(crate) damage: Vec<f64>,
    /// Area by regimes of wear.
    pub(crate) regimes: [f64; 3],
    /// Error of the area due to the errors of the contact.
    pub(crate) open: f64,
}

impl BodyWear {
    /// Rail and wheel without wear.
    pub(crate) fn none(on: Sections) -> [BodyWear; 2] {
        on.points.map(|points| BodyWear {
            area: vec![0.0; points.len()],
            damage: vec![0.0; points.len()],
            ..BodyWear::default()
        })
    }

    pub(crate) fn add(&mut self, share: f64, other: &BodyWear) {
        add(&mut self.area, share, &other.area);
        add(&mut self.damage, share, &other.damage);
        add(&mut self.regimes, share, &other.regimes);
        self.open += share * other.open;
    }

    /// Smooths the wear along the section with a kernel of standard deviation `deviation` in mm.
    pub(crate) fn spread(mut self, deviation: f64) -> BodyWear {
        self.area = smoothed(&self.area, deviation);
        self.damage = smoothed(&self.damage, deviation);
        self
    }
}

/// A solved state.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Pass {
    /// Rail and wheel.
    pub(crate) wear: [BodyWear; 2],
    pub(crate) contact: StateContact,
    /// Remarks of the solution.
    pub(crate) remarks: Vec<RemarkEntry>,
}

/// Solves a state. A state without an answer causes no wear and reports the reason.
///
/// # Errors
/// Returns [`SolveError::Cancelled`] and [`SolveError::OutOfTime`] only.
pub(crate) fn pass(
    task: &Evolution,
    context: &SolveContext,
    on: Sections,
    values: &[f64],
    monitor: &dyn Monitor,
) -> Result<Pass, SolveError> {
    let unsolved = |reason: String| Pass {
        wear: BodyWear::none(on),
        contact: StateContact {
            failure: Some(reason),
            ..StateContact::default()
        },
        remarks: Vec::new(),
    };
    let case = task.case(on, values);
    let check = |case| crate::check_with(&context.known, &case, &task.limits);
    let checked = match case.and_then(check) {
        Ok(checked) => checked,
        Err(error) => return Ok(unsolved(error.to_string())),
    };
    let solution = match crate::solve_with(&context.operators, &checked, monitor) {
        Ok((solution, _)) => solution,
        Err(error @ (SolveError::Cancelled | SolveError::OutOfTime { .. })) => return Err(error),
        Err(error) => return Ok(unsolved(error.to_string())),
    };
    let NormalTask::Wheel(wheel) = &checked.problem.task else {
        return Ok(unsolved("not a wheel on a rail".to_owned()));
    };
    // The coordinate across a patch runs to the left, the points of the sections to the field side.
    let to_left = wheel.geometry.placement.side.sign();
    let mut wear = BodyWear::none(on);
    let mut patches = Vec::new();
    for patch in &solution.patches {
        let Some(position) = patch.position else {
            continue;
        };
        patches.push(StatePatch {
            rail_mm: position.rail_mm,
            wheel_mm: position.wheel_mm,
            normal_force_n: patch.normal_force_n,
            pressure_max_mpa: patch.pressure_max_mpa,
            t_gamma_n: patch.points[0].friction_power_n,
        });
        // Each line of the wheel is in contact once in a revolution.
        let turn = 2.0 * PI * position.rolling_radius_mm;
        let places = [(position.rail_mm, 1.0), (position.wheel_mm, 1.0 / turn)];
        for (k, (at, share)) in places.into_iter().enumerate() {
            let arc = PatchArc::new(on.points[k], at, to_left);
            add_patch(task.plan.wear_model, patch, &arc, share, &mut wear[k]);
        }
    }
    let total = &solution.total[0];
    let ratio = total.force_y_n.abs() / total.force_z_n.unwrap_or(f64::NAN).abs();
    Ok(Pass {
        wear,
        contact: StateContact {
            y_over_q: if ratio.is_finite() { ratio } else { 0.0 },
            patches,
            ..StateContact::default()
        },
        remarks: solution.remarks,
    })
}

/// Adds a share of the wear of one pass of a patch.
fn add_patch(
    model: DamageModel,
    patch: &PatchSolution,
    arc: &PatchArc,
    share: f64,
    wear: &mut BodyWear,
) {
    let damage = patch.points[0].damage.as_deref();
    let Some((damage, across)) = damage.and_then(|own| Some((own, own.across.as_ref()?))) else {
        return;
    };
    let regimes = match model {
        DamageModel::ArchardWear => &across.archard_regimes_nm,
        _ => &across.usfd_regimes_nm,
    };
    let open = damage.t_gamma.map_or(0.0, |t_gamma| {
        let with_spin = t_gamma.with_spin_n;
        let high = with_spin.high.unwrap_or(with_spin.value);
        (high - with_spin.value) / with_spin.value.max(f64::MIN_POSITIVE)
    });
    let fatigue = damage.wlrm.map_or(0.0, |wlrm| wlrm.damage_per_pass.value);
    let strips = across.y_mm.iter().zip(&across.dy_mm);
    for ((y, dy), regimes) in strips.zip(regimes.iter().flatten()) {
        let parts = regimes.map(|depth| share * depth * dy / NANOMETRES);
        let area: f64 = parts.iter().sum();
        wear.open += area * open.min(1.0);
        add(&mut wear.regimes, 1.0, &parts);
        arc.share_out([y - 0.5 * dy, y + 0.5 * dy], |point, part| {
            wear.area[point] += part * area;
            wear.damage[point] += share * fatigue * (part * dy / arc.lengths[point]).min(1.0);
        });
    }
}

/// The coordinate across a patch along the arc of a section.
struct PatchArc {
    /// Arc length at which the coordinate is 0.
    zero: f64,
    to_left: f64,
    /// Length of the part of the section that each point represents.
    lengths: Vec<f64>,
    /// Arc length at which this part ends; infinite for the last point.
    ends: Vec<f64>,
}

impl PatchArc {
    /// The arc of a patch whose load centre is at `at`.
    fn new(points: &[[f64; 2]], at: [f64; 2], to_left: f64) -> PatchArc {
        let from_point = |k: usize| [0, 1].map(|i| at[i] - points[k][i]);
        let off = |k: &usize| from_point(*k).iter().map(|d| d * d).sum::<f64>();
        let nearest = (0..points.len()).min_by(|a, b| off(a).total_cmp(&off(b)));
        let nearest = nearest.unwrap_or(0);
        let along = arc_lengths(points);
        let (low, high) = (nearest.saturating_sub(1), nearest + 1);
        let high = high.min(points.len() - 1);
        let chord = [0, 1].map(|k| points[high][k] - points[low][k]);
        let [y, z] = from_point(nearest);
        let of_centre = along[nearest] + (y * chord[0] + z * chord[1]) / chord[0].hypot(chord[1]);
        let middles = along.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
        PatchArc {
            zero: of_centre,
            to_left,
            lengths: lengths(points),
            ends: middles.chain([f64::INFINITY]).collect(),
        }
    }

    /// Calls `take` with each point whose part overlaps an interval of the coordinate, and the share of the interval there. Parts of the interval
    /// beyond the ends are assigned to the last points.
    fn share_out(&self, interval: [f64; 2], mut take: impl FnMut(usize, f64)) {
        let [from, to] = interval.map(|y| self.zero + self.to_left * y);
        let (from, to) = (from.min(to), from.max(to));
        let mut begin = from;
        for point in self.ends.partition_point(|end| *end <= from)..self.ends.len() {
            let end = self.ends[point].min(to);
            take(point, (end - begin) / (to - from));
            if end >= to {
                return;
            }
            begin = end;
        }
    }
}
