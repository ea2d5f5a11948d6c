//! The wear of one pass of a state on both sections, from its solved contact.

use std::f64::consts::PI;

use crate::contact;
use crate::contact::case::words::damage::DamageModel;
use crate::contact::error::SolveError;
use crate::contact::evolution::section::{along, lengths, smoothed};
use crate::contact::evolution::task::{Evolution, SPACING, SolveContext};
use crate::contact::geometry::profile::Body;
use crate::contact::monitor::Monitor;
use crate::contact::normal::normal_task::NormalTask;
use crate::contact::normal::wheel_height::task::ReferenceSurface;
use crate::contact::post::units::NANOMETRES;
use crate::contact::solution::words::answer::{PatchSolution, Position};
use crate::contact::solution::words::evolution::{StateContact, StatePatch};
use crate::contact::surface_fallback::is_on_planes;

/// Wear of one body: of the rail in one pass, of the wheel over 1 mm rolled.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct BodyWear {
    /// Area in mm² that is lost at each point.
    pub(crate) area: Vec<f64>,
    /// Damage at each point.
    pub(crate) damage: Vec<f64>,
    /// Area by regimes of wear.
    pub(crate) regimes: [f64; 3],
    /// Area that the errors of the contact leave open.
    pub(crate) open: f64,
}

impl BodyWear {
    pub(crate) fn none(points: usize) -> BodyWear {
        BodyWear {
            area: vec![0.0; points],
            damage: vec![0.0; points],
            ..BodyWear::default()
        }
    }

    pub(crate) fn add(&mut self, share: f64, other: &BodyWear) {
        let add = |to: &mut [f64], from: &[f64]| {
            to.iter_mut()
                .zip(from)
                .for_each(|(to, from)| *to += share * from);
        };
        add(&mut self.area, &other.area);
        add(&mut self.damage, &other.damage);
        add(&mut self.regimes, &other.regimes);
        self.open += share * other.open;
    }

    /// Smooths the wear along the section with a kernel of standard deviation `deviation` in mm.
    pub(crate) fn spread(mut self, deviation: f64) -> BodyWear {
        self.area = smoothed(&self.area, SPACING, deviation);
        self.damage = smoothed(&self.damage, SPACING, deviation);
        self
    }
}

/// The sections that a state is solved on, and what has changed beside them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sections<'a> {
    /// Rail and wheel.
    pub(crate) points: [&'a [[f64; 2]]; 2],
    pub(crate) friction: Option<f64>,
    /// Change of the wheel's radius in mm.
    pub(crate) radius: f64,
}

/// A solved state.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Pass {
    /// Rail and wheel.
    pub(crate) wear: [BodyWear; 2],
    pub(crate) contact: StateContact,
}

/// Wear of all states over the extent.
pub(crate) struct Evaluation {
    /// Rail and wheel.
    pub(crate) wear: [BodyWear; 2],
    pub(crate) states: Vec<StateContact>,
}

/// Solves a state. One without an answer wears nothing and says why.
///
/// # Errors
/// [`SolveError::Cancelled`] and [`SolveError::OutOfTime`] only.
pub(crate) fn pass(
    task: &Evolution,
    context: &SolveContext,
    on: Sections,
    values: &[f64],
    monitor: &dyn Monitor,
) -> Result<Pass, SolveError> {
    let unsolved = |reason: String| Pass {
        wear: on.points.map(|points| BodyWear::none(points.len())),
        contact: StateContact {
            share: 0.0,
            y_over_q: 0.0,
            patches: Vec::new(),
            failure: Some(reason),
        },
    };
    let case = task.case(on.points, values, on.friction, on.radius);
    let checked = match case.and_then(|case| task.checked(context, &case)) {
        Ok(checked) => checked,
        Err(error) => return Ok(unsolved(error.to_string())),
    };
    let solution = match contact::solve_with(&context.operators, &checked, monitor) {
        Ok((solution, _)) => solution,
        Err(error @ (SolveError::Cancelled | SolveError::OutOfTime { .. })) => return Err(error),
        Err(error) => return Ok(unsolved(error.to_string())),
    };
    let NormalTask::Wheel(wheel) = &checked.problem.task else {
        return Ok(unsolved("not a wheel on a rail".to_owned()));
    };
    let on_curve = wheel.surface != ReferenceSurface::Planes && !is_on_planes(&solution);
    let mut wear = on.points.map(|points| BodyWear::none(points.len()));
    let mut patches = Vec::new();
    for patch in &solution.patches {
        let Some(position) = patch.position else {
            continue;
        };
        let t_gamma = patch.points[0].friction_power_n;
        patches.push(StatePatch {
            rail_mm: position.rail_mm,
            wheel_mm: position.wheel_mm,
            normal_force_n: patch.normal_force_n,
            pressure_max_mpa: patch.pressure_max_mpa,
            t_gamma_n: t_gamma,
        });
        for (body, wear) in [Body::Rail, Body::Wheel].into_iter().zip(&mut wear) {
            let points = on.points[usize::from(body == Body::Wheel)];
            let place = PatchPlace {
                position: &position,
                on_curve,
                to_left: wheel.geometry.placement.side.sign(),
            };
            add_patch(task.plan.wear_model, patch, &place, body, points, wear);
        }
    }
    let total = &solution.total[0];
    let vertical = total.force_z_n.unwrap_or(f64::NAN).abs();
    let ratio = total.force_y_n.abs() / vertical;
    Ok(Pass {
        wear,
        contact: StateContact {
            share: 0.0,
            y_over_q: if ratio.is_finite() { ratio } else { 0.0 },
            patches,
            failure: None,
        },
    })
}

/// Where a patch lies.
struct PatchPlace<'a> {
    position: &'a Position,
    on_curve: bool,
    /// Direction of the coordinate across the patch along the points of the sections: it runs to the left, they to the field side.
    to_left: f64,
}

fn add_patch(
    model: DamageModel,
    patch: &PatchSolution,
    place: &PatchPlace,
    body: Body,
    points: &[[f64; 2]],
    wear: &mut BodyWear,
) {
    let Some(damage) = patch.points[0].damage.as_deref() else {
        return;
    };
    let Some(across) = &damage.across else { return };
    let regimes = match model {
        DamageModel::ArchardWear => &across.archard_regimes_nm,
        _ => &across.usfd_regimes_nm,
    };
    let Some(regimes) = regimes else { return };
    // A line of the wheel is passed once in a turn.
    let over = match body {
        Body::Rail => 1.0,
        Body::Wheel => 1.0 / (2.0 * PI * place.position.rolling_radius_mm),
    };
    let open = damage.t_gamma.map_or(0.0, |t_gamma| {
        let with_spin = t_gamma.with_spin_n;
        let high = with_spin.high.unwrap_or(with_spin.value);
        (high - with_spin.value) / with_spin.value.max(f64::MIN_POSITIVE)
    });
    let fatigue = damage.wlrm.map_or(0.0, |wlrm| wlrm.damage_per_pass.value);
    let arc = PatchArc::new(points, place, body);
    let lengths = lengths(points);
    for ((y, dy), regimes) in across.y_mm.iter().zip(&across.dy_mm).zip(regimes) {
        let parts = regimes.map(|depth| over * depth * dy / NANOMETRES);
        let area: f64 = parts.iter().sum();
        wear.open += area * open.min(1.0);
        (0..3).for_each(|k| wear.regimes[k] += parts[k]);
        arc.share_out([y - 0.5 * dy, y + 0.5 * dy], |point, share| {
            wear.area[point] += share * area;
            wear.damage[point] += over * fatigue * (share * dy / lengths[point]).min(1.0);
        });
    }
}

/// The coordinate across a patch along the arc of a section.
struct PatchArc {
    /// Arc length at which the coordinate is 0.
    zero: f64,
    to_left: f64,
    /// Arc length at which the part of the section ends that each point stands for; no end for the last one.
    ends: Vec<f64>,
}

impl PatchArc {
    fn new(points: &[[f64; 2]], place: &PatchPlace, body: Body) -> PatchArc {
        let position = place.position;
        let centre = match body {
            Body::Rail => position.rail_mm,
            Body::Wheel => position.wheel_mm,
        };
        let from_centre = |at: &[f64; 2]| [0, 1].map(|k| centre[k] - at[k]);
        let off = |k: &usize| from_centre(&points[*k]).iter().map(|d| d * d).sum::<f64>();
        let nearest = (0..points.len()).min_by(|a, b| off(a).total_cmp(&off(b)));
        let nearest = nearest.unwrap_or(0);
        let along = along(points);
        let [low, high] = [
            nearest.saturating_sub(1),
            (nearest + 1).min(points.len() - 1),
        ];
        let chord = [0, 1].map(|k| points[high][k] - points[low][k]);
        let [y, z] = from_centre(&points[nearest]);
        let of_centre = along[nearest] + (y * chord[0] + z * chord[1]) / chord[0].hypot(chord[1]);
        // The coordinate of the load centre: on a curve it is counted from there.
        let own = match place.on_curve {
            true => 0.0,
            false => {
                let (sin, cos) = position.contact_angle_rad.sin_cos();
                let [y, z] = [1, 2].map(|k| position.track_mm[k] - position.origin_track_mm[k]);
                y * cos + z * sin
            }
        };
        let middles = along.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
        PatchArc {
            zero: of_centre - place.to_left * own,
            to_left: place.to_left,
            ends: middles.chain([f64::INFINITY]).collect(),
        }
    }

    /// Calls `take` with each point whose part meets an interval of the coordinate, and the share of the interval there. What lies beyond the ends
    /// goes to the last points.
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
