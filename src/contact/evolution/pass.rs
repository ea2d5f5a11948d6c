//! The wear of one pass of a state on both sections, from its solved contact.

use std::f64::consts::PI;

use crate::contact;
use crate::contact::case::words::damage::DamageModel;
use crate::contact::error::SolveError;
use crate::contact::evolution::section::{along, lengths};
use crate::contact::evolution::task::{Evolution, SolveContext};
use crate::contact::geometry::profile::Body;
use crate::contact::geometry::wheel_rail::Placement;
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
        let place = PatchPlace {
            placement: &wheel.geometry.placement,
            position: &position,
            on_curve,
        };
        for (body, wear) in [Body::Rail, Body::Wheel].into_iter().zip(&mut wear) {
            let points = on.points[usize::from(body == Body::Wheel)];
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
    placement: &'a Placement,
    position: &'a Position,
    on_curve: bool,
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
    let cells = Cells::new(points, place, body);
    let lengths = lengths(points);
    for ((y, dy), regimes) in across.y_mm.iter().zip(&across.dy_mm).zip(regimes) {
        let parts = regimes.map(|depth| over * depth * dy / NANOMETRES);
        let area: f64 = parts.iter().sum();
        wear.open += area * open.min(1.0);
        (0..3).for_each(|k| wear.regimes[k] += parts[k]);
        cells.share_out([y - 0.5 * dy, y + 0.5 * dy], |point, share, width| {
            wear.area[point] += share * area;
            wear.damage[point] += over * fatigue * (share * width / lengths[point]).min(1.0);
        });
    }
}

/// The parts of a section that its points stand for, in the coordinate across a patch.
struct Cells {
    /// The number of the first one, and the step to the next: points run to the field side, the coordinate to the left.
    first: usize,
    forward: bool,
    /// Edges, ascending; one more than cells.
    edges: Vec<f64>,
}

impl Cells {
    fn new(points: &[[f64; 2]], place: &PatchPlace, body: Body) -> Cells {
        let PatchPlace {
            placement,
            position,
            on_curve,
        } = place;
        let sign = placement.side.sign();
        let (sin, cos) = position.contact_angle_rad.sin_cos();
        let centre = match body {
            Body::Rail => position.rail_mm,
            Body::Wheel => position.wheel_mm,
        };
        let off = |at: &[f64; 2]| (at[0] - centre[0]).hypot(at[1] - centre[1]);
        let nearest =
            (0..points.len()).min_by(|a, b| off(&points[*a]).total_cmp(&off(&points[*b])));
        let nearest = nearest.unwrap_or(0);
        // The tangent of the patch on the section: mirrored on the right, turned back by cant or roll, z down.
        let tangent = match body {
            Body::Rail => {
                let (turn, level) = placement.cant.sin_cos();
                [
                    level * sign * cos + turn * sin,
                    turn * sign * cos - level * sin,
                ]
            }
            Body::Wheel => {
                let (turn, level) = placement.roll.sin_cos();
                [sign * (cos * level + sin * turn), cos * turn - sin * level]
            }
        };
        let in_plane =
            |at: &[f64; 2]| (at[0] - centre[0]) * tangent[0] + (at[1] - centre[1]) * tangent[1];
        let places: Vec<f64> = if *on_curve {
            let along = along(points);
            let near = &points[nearest];
            let of_centre = along[nearest] - sign * in_plane(near);
            along.iter().map(|s| sign * (s - of_centre)).collect()
        } else {
            let origin = [1, 2].map(|k| position.track_mm[k] - position.origin_track_mm[k]);
            let own = origin[0] * cos + origin[1] * sin;
            points.iter().map(|at| own + in_plane(at)).collect()
        };
        let forward = sign > 0.0;
        let rises = |k: usize| (places[k + 1] > places[k]) == forward;
        let (mut low, mut high) = (nearest, nearest);
        while low > 0 && rises(low - 1) {
            low -= 1;
        }
        while high + 1 < places.len() && rises(high) {
            high += 1;
        }
        let middles = (low..high).map(|k| 0.5 * (places[k] + places[k + 1]));
        let mut edges: Vec<f64> = std::iter::once(places[low])
            .chain(middles)
            .chain([places[high]])
            .collect();
        if !forward {
            edges.reverse();
        }
        Cells {
            first: if forward { low } else { high },
            forward,
            edges,
        }
    }

    /// Calls `take` with each point whose part meets an interval, the share of the interval there, and the interval's width. What lies beyond
    /// the ends goes to the last points.
    fn share_out(&self, [from, to]: [f64; 2], mut take: impl FnMut(usize, f64, f64)) {
        let last = self.edges.len() - 2;
        let mut cell = self
            .edges
            .partition_point(|edge| *edge <= from)
            .saturating_sub(1)
            .min(last);
        let mut begin = from;
        loop {
            let end = if cell == last {
                to
            } else {
                self.edges[cell + 1].min(to)
            };
            if end > begin {
                let point = match self.forward {
                    true => self.first + cell,
                    false => self.first - cell,
                };
                take(point, (end - begin) / (to - from), to - from);
                begin = end;
            }
            if cell == last || begin >= to {
                return;
            }
            cell += 1;
        }
    }
}
