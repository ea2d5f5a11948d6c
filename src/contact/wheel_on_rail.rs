//! Solves a wheel on a rail: pressures at one height of the wheel and tractions on the surface of the rail, in turn, until each belongs to the other.
//!
//! Coordinates of the surface are x and the arc length s of the rail's cross-section. The rigid slip of every point is that of the wheel's
//! undeformed surface above it, so that spin, rolling radius and direction follow the bend. Friction carries a part of a vertical load, tractions
//! open the gap and pressures make the surfaces slip; each round solves one with the other of the round before.
//!
//! On planes of contact, which replace parts of the curve, every plane has tractions of its own, under the slip of a plane, and any method solves them.
//! Only a vertical load connects them to the pressures: several motions share the pressures without tractions.

use std::sync::Arc;

use crate::contact::case::words::solver::Output;
use crate::contact::error::SolveError;
use crate::contact::friction::law::FrictionLaw;
use crate::contact::friction::on_rail::on_rail;
use crate::contact::geometry::contact_locus::ContactLocus;
use crate::contact::geometry::reference_curve::{
    CurvePlace, ReferenceCurve, RigidMotion, WheelOver,
};
use crate::contact::half_space::bent_surface::{Influence, TURN_MAX};
use crate::contact::monitor::{Monitor, MonitorPart};
use crate::contact::normal::footprint::Footprint;
use crate::contact::normal::gap::answer::NormalError;
use crate::contact::normal::gap::grid::GridFineness;
use crate::contact::normal::on_curve::{CurveContact, CurveTask, Friction, Workspace};
use crate::contact::normal::patch::Patch;
use crate::contact::normal::pressure_field::field::PressureField;
use crate::contact::normal::pressure_field::grid_pressure::GridPressure;
use crate::contact::normal::surface_slip::SurfaceSlip;
use crate::contact::normal::wheel::task::{ReferenceSurface, WheelLoad, WheelTask};
use crate::contact::normal::wheel::wheel_contact::{WheelContact, WheelPatch};
use crate::contact::normal_stage::SolvedFootprint;
use crate::contact::post::damage::evaluate::{DamagedPatch, damage};
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::problem::coupled::negligible;
use crate::contact::problem::run::Run;
use crate::contact::remark::entry::{RemarkEntry, merged};
use crate::contact::remark::kind::short;
use crate::contact::remark::list::Remark;
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::operator_store::OperatorStore;
use crate::contact::rolling_stage;
use crate::contact::solution::assemble::normalised;
use crate::contact::solution::moved::move_origin;
use crate::contact::solution::words::answer::{
    ErrorEstimate, NormalReport, Origin, PatchSolution, Position, Solution, Total,
};
use crate::contact::solution::words::damage::Damage;
use crate::contact::solution::words::fields::{Fields, PatchFields};
use crate::contact::time_limit::TimeLimit;
use crate::contact::traction_estimate::{can_estimate, patch_forces};
use crate::contact::unlike_bodies::LEFT_BY_PRESSURE;
use crate::contact::unlike_motions::tell_region;
use crate::contact::vertical_equilibrium::{next_share, tolerance};

/// Allowed error of the resultants relative to μN on the coarse grid: that of the coarsest meshes, whatever the few cells of a small patch leave open.
const TARGET_ROUGH: f64 = 0.2;
/// Rounds at most; 3 to 6 suffice.
const ROUNDS_MAX: u32 = 16;
/// Patches at most. Rough profiles have more, each of a few points; their tractions would be solved together for minutes and mean nothing.
const PATCHES_MAX: usize = 4;
/// Length over width at most, of patches with more than this share of the load. Hertz's patch of a gauge corner of 13 mm is 11 times as long as wide, a
/// contact at the root of a flange 20 times, and a single point that is off makes a ridge a hundred times as long.
const SLENDER_MAX: f64 = 40.0;
const SLENDER_SHARE: f64 = 0.02;
/// Change of the forces relative to μN over the target that ends the rounds.
const CHANGE: f64 = 0.1;
/// Part by which the gap that tractions open is off if they are taken to be proportional to the pressure.
const FORECAST_OFF: f64 = 0.3;
/// Change of the forces relative to μN that ends the rounds on the coarse grid.
const CHANGE_ROUGH: f64 = 0.02;
/// When the rounds are used up, a change of the forces relative to μN up to this is answered with a remark.
const CHANGE_POOR: f64 = 5e-3;
/// Errors of the factors for the turn relative to μN: this times the standard deviation of the angle over the load, in rad, and at most that. Against
/// boundary elements of seven wheels on rails with μ of 0.3 they are 0.2 to 1.5 % where the angle deviates by 0.07 to 0.5 rad; half of these the factors were
/// fitted to.
const OPEN_BY_TURN: f64 = 0.2;
const OPEN_MAX: f64 = 0.035;
/// The errors by the turn grow with the difference of the two bodies' shares of the displacement, times this. On a bent surface the stiffness of a convex and
/// of a concave body changes in opposite directions, by boundary elements of each body alone; the factors hold for their mean. The value was derived from these
/// single-body results (about 2 in lateral forces); it was not compared with boundary elements of unequal pairs.
const OPEN_BY_UNEQUAL: f64 = 2.5;
/// Lateral forces of pressures count as under this coefficient of friction at least.
const FRICTION_OPEN: f64 = 0.3;
/// Axes, origins and signs in words.
const FRAME: &str = "every patch on the surface of the rail: x along rolling (leading edge at larger x), y to the left along the cross-section, \
                     z out of the rail, origin at its load centre; forces of a patch at its mean contact angle; total in track axes: x along \
                     rolling, y to the left, z up; forces, moments and tractions act on the lower body, slip is that of the upper body relative \
                     to the lower one";

/// The wheel at rest with the answer for all its patches.
pub(crate) struct SolvedWheel {
    pub(crate) wheel: WheelContact,
    pub(crate) solution: Solution,
    pub(crate) fields: Fields,
}

/// Asked of a wheel at rest before its motions are solved: is there any point in it, and if not, why.
pub(crate) type BeforeMotions<'a> = dyn FnMut(&WheelContact) -> Result<(), SolveError> + 'a;

/// Solves a wheel on a rail. Of several motions `before` is asked about the wheel without tractions. On the curve tractions change pressures, so that
/// every motion has its own; of several motions, the wheel and the patches of the answer are those of the first. The points of a history, and motions on
/// planes, share the pressures without tractions.
///
/// # Errors
/// A named reason why there is no answer.
pub(crate) fn solve(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    contact: &WheelTask,
    before: &mut BeforeMotions,
    monitor: &dyn Monitor,
) -> Result<SolvedWheel, SolveError> {
    let motions = case.problem.motions.len();
    let (curve, influence) = surface(case, contact, monitor)?;
    let shared = case.problem.history.is_some() || curve.is_flat();
    let together = if shared { motions } else { 1 };
    let patches = match case.problem.part.all > together && !curve.is_flat() {
        false => None,
        true => Some(patches_at_rest(case, contact, before, monitor)?),
    };
    let mut whole: Option<SolvedWheel> = None;
    for index in (0..motions).step_by(together) {
        let part = case.slice(index..index + together);
        let share = MonitorPart {
            inner: monitor,
            before: index as f64 / motions as f64,
            own: together as f64 / motions as f64,
        };
        let watch = TimeLimit::new(&share, case.run.time_limit, 1);
        let solve = WheelSolve::new(operators, &part, contact, influence, &curve, &watch);
        let solved = solve.and_then(|solve| solve.motion(before, patches));
        let solved = solved.map_err(|error| watch.explained(error, &part))?;
        match &mut whole {
            None => whole = Some(solved),
            Some(whole) => {
                whole.solution.append(solved.solution);
                whole.fields.append(solved.fields);
            }
        }
    }
    let Some(whole) = whole else {
        unreachable!("a case has at least one motion")
    };
    Ok(whole)
}

/// The reference surface of a contact, with the influence of its strips on each other.
fn surface<'a>(
    case: &CheckedCase,
    contact: &'a WheelTask,
    monitor: &dyn Monitor,
) -> Result<(ReferenceCurve<'a>, Influence), SolveError> {
    let curve = ReferenceCurve::new(&contact.geometry);
    if let ReferenceSurface::Curve { influence, .. } = contact.surface {
        return Ok((curve, influence));
    }
    let locus = ContactLocus::new(&contact.geometry)
        .map_err(|reason| SolveError::NormalProblem { reason })?;
    let influence = Influence::HalfSpace;
    let mut planes =
        coarse(case, contact, &curve, contact.loading, monitor)?.planes(&curve, &locus);
    let alone = case.problem.part.all == 1 && case.problem.history.is_none();
    let flat = curve.on_planes(planes.clone());
    let (operators, watch) = (
        Arc::default(),
        TimeLimit::new(monitor, case.run.time_limit, 1),
    );
    let solve = WheelSolve::new(&operators, case, contact, influence, &flat, &watch)?;
    if alone && solve.is_vertical() {
        // Friction changes the height.
        let (_, found) = solve.coarse(true, &mut Workspace::default())?;
        let lowering = WheelLoad::Lowering(solve.touch - found.centre);
        planes = coarse(case, contact, &curve, lowering, monitor)?.planes(&curve, &locus);
    }
    Ok((curve.on_planes(planes), influence))
}

/// The contact of a wheel on the curve of its rail without tractions, on a coarse grid.
fn coarse(
    case: &CheckedCase,
    contact: &WheelTask,
    curve: &ReferenceCurve,
    loading: WheelLoad,
    monitor: &dyn Monitor,
) -> Result<CurveContact, SolveError> {
    let watch = TimeLimit::new(monitor, case.run.time_limit, 1);
    let operators = Arc::default();
    let influence = Influence::HalfSpace;
    let solve = WheelSolve::new(&operators, case, contact, influence, curve, &watch)?;
    let task = CurveTask {
        loading,
        ..solve.task()
    };
    let found = task.coarse(&mut Workspace::default(), &watch);
    found.map_err(|failure| watch.explained(failure.into(), case))
}

/// About the largest pressure in MPa of the patch with the largest load.
///
/// # Errors
/// The wheel does not come to rest on the rail, or the monitor stopped the work.
pub(crate) fn largest_pressure(
    case: &CheckedCase,
    contact: &WheelTask,
    monitor: &dyn Monitor,
) -> Result<f64, SolveError> {
    let curve = ReferenceCurve::new(&contact.geometry);
    Ok(coarse(case, contact, &curve, contact.loading, monitor)?.main_pressure())
}

/// How many patches a wheel has without tractions: those of an answer to several motions, which has one list of patches.
///
/// # Errors
/// Why the wheel does not come to rest; or what `before` says.
pub(crate) fn patches_at_rest(
    case: &CheckedCase,
    contact: &WheelTask,
    before: &mut BeforeMotions,
    monitor: &dyn Monitor,
) -> Result<usize, SolveError> {
    let (curve, influence) = surface(case, contact, monitor)?;
    let watch = TimeLimit::new(monitor, case.run.time_limit, 1);
    let operators = Arc::default();
    let solve = WheelSolve::new(&operators, case, contact, influence, &curve, &watch)?;
    let workspace = &mut Workspace::default();
    let task = solve.task();
    let coarse = task.coarse(workspace, &watch);
    let at_rest = coarse
        .and_then(|coarse| task.fine(&coarse, &Friction::default(), workspace, &watch))
        .map_err(|failure| watch.explained(failure.into(), case))?;
    let wheel = solve.wheel(&at_rest)?;
    before(&wheel)?;
    Ok(wheel.patches.len())
}

/// A wheel on a rail, in one motion, one history, or several motions on planes.
#[derive(Clone, Copy)]
struct WheelSolve<'a> {
    operators: &'a Arc<OperatorStore>,
    case: &'a CheckedCase,
    contact: &'a WheelTask,
    influence: Influence,
    curve: &'a ReferenceCurve<'a>,
    touch: f64,
    expected: f64,
    fineness: GridFineness,
    watch: &'a TimeLimit<'a>,
}

/// The end of the rounds.
struct Found {
    contact: CurveContact,
    parts: Vec<Part>,
    /// How much the forces of each motion would change if its tractions and the pressures agreed, relative to μN.
    changes: Vec<f64>,
}

/// Patches that are solved together.
struct Part {
    /// x and s in mm of the origin of its coordinates.
    origin: [f64; 2],
    /// Result of the normal problem about the same origin.
    loads: Vec<Patch>,
    /// Their load centres `[x, s]` in mm.
    centres: Vec<[f64; 2]>,
    solution: Solution,
    fields: Fields,
}

/// Sums over the cells of a patch, in N.
#[derive(Clone, Copy, Default)]
struct PatchForces {
    /// Pressures times the sine and the cosine of the angle of their strips.
    pressed: [f64; 2],
    /// Tractions along x, and those along s times the cosine and the sine.
    sheared: [f64; 3],
}

impl PatchForces {
    /// The angle at which the pressures have no resultant along the tangent.
    fn angle(&self) -> f64 {
        self.pressed[0].atan2(self.pressed[1])
    }

    /// The force on the rail in track axes.
    fn in_track(&self) -> [f64; 3] {
        let ([across, down], [x, y, z]) = (self.pressed, self.sheared);
        [x, y + across, z - down]
    }
}

impl Part {
    /// Adds to the estimates of all forces of a motion what is left open of them, relative to the friction limit.
    fn leave_open(&mut self, index: usize, share: f64) {
        let mut all = ErrorEstimate::default();
        for patch in &mut self.solution.patches {
            let limit = patch.friction_limit_n.unwrap_or(0.0);
            let open = ErrorEstimate {
                force_x_n: share * limit,
                force_y_n: share * limit,
                moment_z_n_mm: 0.0,
            };
            let point = &mut patch.points[index];
            point.error_estimate = point.error_estimate.map(|error| error.plus(open));
            let of_pressure = share * FRICTION_OPEN * patch.normal_force_n;
            all = all.plus(ErrorEstimate {
                force_y_n: open.force_y_n.max(of_pressure),
                ..open
            });
        }
        let total = &mut self.solution.total[index];
        total.error_estimate = total.error_estimate.map(|error| error.plus(all));
    }
}

impl<'a> WheelSolve<'a> {
    fn new(
        operators: &'a Arc<OperatorStore>,
        case: &'a CheckedCase,
        contact: &'a WheelTask,
        influence: Influence,
        curve: &'a ReferenceCurve<'a>,
        watch: &'a TimeLimit<'a>,
    ) -> Result<WheelSolve<'a>, SolveError> {
        let [touch, expected] = contact
            .first_touch()
            .map_err(|reason| SolveError::NormalProblem { reason })?;
        Ok(WheelSolve {
            operators,
            case,
            contact,
            influence,
            curve,
            touch,
            expected,
            fineness: GridFineness::for_answer(case.run.target()),
            watch,
        })
    }

    fn task(&self) -> CurveTask<'_> {
        CurveTask {
            curve: self.curve,
            elasticity: &self.case.problem.elasticity,
            influence: self.influence,
            loading: self.contact.loading,
            touch: self.touch,
            expected: self.expected,
            fineness: self.fineness,
        }
    }

    /// The wheel at rest, and the answer to the motion or the history. As one of several a motion has a number of `patches`: where its tractions would
    /// change that, or leave no answer, pressures are those without tractions, as for a history.
    fn motion(
        &self,
        before: &mut BeforeMotions,
        patches: Option<usize>,
    ) -> Result<SolvedWheel, SolveError> {
        let problem = &self.case.problem;
        let shared = problem.history.is_some() || self.curve.is_flat() && problem.part.all > 1;
        let workspace = &mut Workspace::default();
        let began = self.watch.elapsed();
        let (mut wheel, found) = match patches {
            None => self.rounds(!shared, before, workspace),
            Some(patches) => match self.rounds(true, &mut |_| Ok(()), workspace) {
                Ok(found) if count(&found.1.parts) == patches => Ok(found),
                Ok(_) | Err(SolveError::NormalProblem { .. }) => self
                    .rounds(false, &mut |_| Ok(()), workspace)
                    .map(|(mut wheel, found)| {
                        let remark = Remark::NormalForcesAloneBalance {};
                        wheel.remarks.push(remark.into());
                        wheel.remarks.extend(self.first_order());
                        (wheel, found)
                    }),
                Err(error) => Err(error),
            },
        }?;
        let rest = (self.watch.elapsed() - began).as_secs_f64();
        if shared && self.is_vertical() {
            let remark = Remark::NormalForcesAloneBalance {};
            wheel.remarks.push(remark.into());
        }
        let turn_rad = turn(&found.contact);
        if self.is_corrected() && turn_rad > TURN_MAX {
            let range_rad = TURN_MAX;
            wheel.remarks.push(
                Remark::TurnBeyondRange {
                    turn_rad,
                    range_rad,
                }
                .into(),
            );
        }
        if patches.is_some() {
            let of_motion = |remark: &mut RemarkEntry| {
                remark.point = Some(self.case.problem.part.before);
            };
            wheel.remarks.iter_mut().for_each(of_motion);
        }
        let (mut solution, fields) = self.answer(found, &wheel, rest)?;
        if patches.is_some() {
            solution.patches.iter_mut().for_each(tell_region);
        }
        Ok(SolvedWheel {
            wheel,
            solution,
            fields,
        })
    }

    /// Whether factors for the turn of the surface apply.
    fn is_corrected(&self) -> bool {
        self.influence == Influence::AngleCorrected
    }

    /// Whether a vertical force presses the wheel, of which friction carries a part.
    fn is_vertical(&self) -> bool {
        let frictionless = self.case.problem.friction.is_frictionless();
        matches!(self.contact.loading, WheelLoad::Vertical(_)) && !frictionless
    }

    /// The remark that the effect of tractions on pressures is left out, if bodies differ enough for it to matter.
    fn first_order(&self) -> Option<RemarkEntry> {
        let CheckedCase { problem, run, .. } = self.case;
        let matters = problem.first_order_error(run.method) > negligible(run);
        matters.then(|| problem.first_order_remark(run.method).into())
    }

    /// Pressures and tractions in turn: on a coarse grid until friction is known about, then on the fine one. `before` is asked of the wheel at rest
    /// on the fine grid. Unless they are `together`, tractions are solved once, on pressures without friction.
    fn rounds(
        &self,
        together: bool,
        before: &mut BeforeMotions,
        workspace: &mut Workspace,
    ) -> Result<(WheelContact, Found), SolveError> {
        let run = &self.case.run;
        let problem = &self.case.problem;
        let of_gap = self.is_corrected() || problem.elasticity.difference != 0.0;
        let coupled = together
            && (self.is_vertical() || of_gap && !self.curve.is_flat())
            && !problem.friction.is_frictionless();
        let task = self.task();
        let (mut friction, coarse) = self.coarse(coupled, workspace)?;
        let mut contact = task.fine(&coarse, &friction, workspace, self.watch)?;
        friction.opened.clone_from(&contact.opened);
        let first = self.wheel(&contact)?;
        before(&first)?;
        let exact = with_tractions(run, &run.outputs);
        let target = run.resolution.target_or_usual();
        let balance = tolerance(run.resolution);
        let open = match together && !self.curve.is_flat() {
            true => LEFT_BY_PRESSURE * problem.elasticity.difference.abs(),
            false => problem.first_order_error(run.method),
        };
        let mut earlier = None;
        for round in 1..=ROUNDS_MAX {
            let parts = self.tractions(&contact, &exact, open, workspace)?;
            let (mut next, mut change) = (Friction::default(), 0.0);
            if coupled {
                next = self.friction(&contact, &parts, workspace);
                let [by_lift, by_gap] = contact.change_by(&friction, &next, self.shared());
                let by_gap = by_gap * contact.normal_force() / limit(&parts);
                change = (by_lift / balance).max(by_gap / (CHANGE * target));
            }
            if change <= 1.0 || round == ROUNDS_MAX {
                let residual = change * CHANGE * target;
                if change > 1.0 && residual > CHANGE_POOR {
                    return Err(SolveError::NormalProblem {
                        reason: format!(
                            "pressures and tractions on the curve of the rail do not come to agree in {ROUNDS_MAX} rounds: forces still change by \
                             {:.1} % of the friction limit; give reference_surface \"plane\"",
                            100.0 * residual
                        ),
                    });
                }
                let remark = Remark::IterationInexact {
                    iteration: "pressures and tractions on the curve of the rail",
                    reason: "the rounds were used up",
                    residual,
                    tolerance: CHANGE * target,
                };
                let mut wheel = match round {
                    1 => first,
                    _ => self.wheel(&contact)?,
                };
                let changes = match together || self.curve.is_flat() {
                    true => vec![residual; problem.motions.len()],
                    false => self.neglected(coarse, &parts, workspace)?,
                };
                wheel.remarks.extend((change > 1.0).then(|| remark.into()));
                let found = Found {
                    contact,
                    parts,
                    changes,
                };
                return Ok((wheel, found));
            }
            friction = accelerated(&friction, next, &mut earlier);
            contact = task.again(contact, &friction, workspace, self.watch)?;
            friction.opened.clone_from(&contact.opened);
        }
        unreachable!("the last round ends them")
    }

    /// How much the gap that the tractions of each motion open would change its forces, relative to μN: by the pressures on a coarse grid under the
    /// tractions that open most, if there are any.
    fn neglected(
        &self,
        coarse: CurveContact,
        parts: &[Part],
        workspace: &mut Workspace,
    ) -> Result<Vec<f64>, SolveError> {
        let (task, still) = (self.task(), Friction::default());
        let contact = task.again(coarse, &still, workspace, self.watch)?;
        let mut largest = (0.0, still.clone());
        let mut changes = Vec::with_capacity(self.case.problem.motions.len());
        for index in 0..self.case.problem.motions.len() {
            let traction = self.on_grid(&contact, parts, index);
            let friction = Friction {
                lift: 0.0,
                opened: contact.operator.opened_by_traction(&traction, workspace),
            };
            let [_, by_gap] = contact.change_by(&still, &friction, 0.0);
            changes.push(by_gap);
            if by_gap > largest.0 {
                largest = (by_gap, friction);
            }
        }
        let (most, friction) = largest;
        if most > 0.0 {
            let (before, normal) = (resultant(&contact), contact.normal_force());
            let change = match task.again(contact, &friction, workspace, self.watch) {
                Ok(opened) => {
                    let [across, down] = minus(resultant(&opened), before);
                    across.hypot(down)
                }
                Err(NormalError::NoAnswer(_)) => most * normal,
                Err(error) => return Err(error.into()),
            };
            let share = change / most / limit(parts);
            changes.iter_mut().for_each(|change| *change *= share);
        }
        Ok(changes)
    }

    /// The wheel at rest on a coarse grid, with about the friction that it will have: by the table of creep forces where that is enough, else with coarse
    /// tractions.
    fn coarse(
        &self,
        coupled: bool,
        workspace: &mut Workspace,
    ) -> Result<(Friction, CurveContact), SolveError> {
        let CheckedCase { problem, run, .. } = self.case;
        let task = self.task();
        let mut coarse = task.coarse(workspace, self.watch)?;
        let mut friction = Friction::default();
        let rough = with_tractions(&run.for_resultants(TARGET_ROUGH), &[]);
        let enough = CHANGE * run.resolution.target_or_usual() / FORECAST_OFF;
        let mut by_table = can_estimate(problem);
        let mut earlier = None;
        for _ in 0..if coupled { ROUNDS_MAX } else { 0 } {
            let limit = problem.friction.largest() * coarse.normal_force();
            let by_gap = |from: &Friction, to: &Friction| {
                let [by_lift, by_gap] = coarse.change_by(from, to, self.shared());
                (by_lift, by_gap * coarse.normal_force() / limit)
            };
            let estimate = match by_table {
                true => Some(self.estimate(&coarse, workspace)?),
                false => None,
            };
            let estimate = estimate.filter(|next| by_gap(&Friction::default(), next).1 <= enough);
            by_table = estimate.is_some();
            let next = match estimate {
                Some(next) => next,
                None => {
                    let parts = self.tractions(&coarse, &rough, 0.0, workspace)?;
                    self.friction(&coarse, &parts, workspace)
                }
            };
            let (by_lift, by_gap) = by_gap(&friction, &next);
            friction = accelerated(&friction, next, &mut earlier);
            if by_table && by_lift <= CHANGE_ROUGH || by_lift.max(by_gap) <= CHANGE_ROUGH {
                break;
            }
            coarse = task.again(coarse, &friction, workspace, self.watch)?;
            friction.opened.clone_from(&coarse.opened);
        }
        Ok((friction, coarse))
    }

    /// What friction does about, by the table of creep forces, with tractions proportional to the pressures.
    fn estimate(
        &self,
        contact: &CurveContact,
        workspace: &mut Workspace,
    ) -> Result<Friction, SolveError> {
        let patches = self.patches(contact)?;
        let mut forces = Vec::with_capacity(patches.len());
        for patch in &patches {
            let CheckedCase { problem, .. } = self.case;
            let motion = match &problem.wheelset {
                None => problem.motions[0],
                Some(wheelset) => {
                    let geometry = &self.contact.geometry;
                    let rigid = RigidMotion::of_wheelset(geometry, contact.centre, wheelset);
                    creepages(&rigid, patch.x, &patch.place, &patch.wheel)
                }
            };
            let extents = std::iter::once(patch.patch().extent);
            let friction = self.friction_at([patch.x, patch.place.s], extents);
            let problem = problem.of_gap(friction, vec![motion]);
            forces.push((patch, patch_forces(&problem, patch, &motion)));
        }
        let lift = match self.is_vertical() {
            true => {
                let lifts = forces
                    .iter()
                    .map(|(patch, force)| force[1] * patch.place.angle.sin());
                lifts.sum()
            }
            false => 0.0,
        };
        let mut traction = [Vec::new(), Vec::new()];
        let rows = contact.pressure.chunks_exact(contact.grid.x.len());
        for (row, place) in rows.zip(&contact.grid.places) {
            let far = |patch: &WheelPatch| (patch.place.s - place.s).abs();
            let nearest = forces
                .iter()
                .min_by(|(a, _), (b, _)| far(a).total_cmp(&far(b)));
            let share = nearest.map_or([0.0; 2], |(patch, force)| {
                force.map(|force| force / patch.normal_force())
            });
            for (traction, share) in traction.iter_mut().zip(share) {
                traction.extend(row.iter().map(|p| share * p));
            }
        }
        let opened = self.opened(contact, &traction, workspace);
        Ok(Friction { lift, opened })
    }

    /// The gap in mm that tractions open; none on planes.
    fn opened(
        &self,
        contact: &CurveContact,
        traction: &[Vec<f64>; 2],
        workspace: &mut Workspace,
    ) -> Option<Vec<f64>> {
        match self.curve.is_flat() {
            true => None,
            false => contact.operator.opened_by_traction(traction, workspace),
        }
    }

    /// Effect of the tractions of all parts on the contact.
    fn friction(
        &self,
        contact: &CurveContact,
        parts: &[Part],
        workspace: &mut Workspace,
    ) -> Friction {
        let lift = match self.is_vertical() {
            true => {
                let forces = self.forces(contact, parts, 0);
                forces.iter().flatten().map(|patch| patch.sheared[2]).sum()
            }
            false => 0.0,
        };
        let traction = self.on_grid(contact, parts, 0);
        let opened = self.opened(contact, &traction, workspace);
        Friction { lift, opened }
    }

    /// Change of the tangential forces caused by a change of the pressures, relative to the normal force; 0 for equal bodies.
    fn shared(&self) -> f64 {
        let CheckedCase { problem, .. } = self.case;
        match problem.elasticity.difference == 0.0 {
            true => 0.0,
            false => problem.friction.largest(),
        }
    }

    /// Solves the tractions of all parts of a contact. For bodies that differ, `open` is the error of the forces due to the pressures, relative to the
    /// friction limit.
    fn tractions(
        &self,
        contact: &CurveContact,
        run: &Run,
        open: f64,
        workspace: &mut Workspace,
    ) -> Result<Vec<Part>, SolveError> {
        let slip = match self.curve.is_flat() {
            true => None,
            false => contact
                .operator
                .slip_of_pressure(&contact.pressure, workspace),
        };
        let parts = contact.parts(self.influence);
        let motions = parts.len() * self.case.problem.motions.len();
        let watch = TimeLimit::new(self.watch, run.time_limit, motions);
        let parts = parts.into_iter().map(|strips| contact.patches(strips));
        let parts: Vec<Vec<GridPressure>> = parts.collect::<Result<_, _>>()?;
        let patches: usize = parts.iter().map(Vec::len).sum();
        if patches > PATCHES_MAX && !self.curve.is_flat() {
            return Err(SolveError::NormalProblem {
                reason: format!(
                    "the contact on the curve of the rail falls into {patches} patches, of which at most {PATCHES_MAX} are solved together; smooth the \
                     profiles, or give reference_surface \"plane\""
                ),
            });
        }
        let mut solved = Vec::with_capacity(parts.len());
        for patches in parts {
            solved.push(self.part(contact, patches, slip.as_ref(), (run, open), &watch)?);
        }
        Ok(solved)
    }

    /// Solves the tractions of some patches together; `slip` is that of the pressures.
    fn part(
        &self,
        contact: &CurveContact,
        patches: Vec<GridPressure>,
        slip: Option<&[Vec<f64>; 2]>,
        (run, open): (&Run, f64),
        watch: &TimeLimit,
    ) -> Result<Part, SolveError> {
        let CheckedCase { problem, label, .. } = self.case;
        let field = CurveContact::field(patches)?;
        let loads = field.patches();
        let centres: Vec<[f64; 2]> = (0..loads.len())
            .map(|k| field.load_centre(Some(k)))
            .collect();
        let heaviest = (0..loads.len())
            .max_by(|a, b| loads[*a].normal_force.total_cmp(&loads[*b].normal_force))
            .unwrap_or(0);
        let origin = match self.curve.is_flat() {
            true => field.load_centre(None),
            false => centres[heaviest],
        };
        let under = |motion: &Motion, of_pressure| {
            let (place, over) = self.load_centre(contact, origin)?;
            let rigid = self.rigid(contact, &field, motion)?;
            let motion = creepages(&rigid[heaviest], origin[0], &place, &over);
            let slip = self.surface_slip(contact, &field, &rigid, of_pressure, origin, &motion);
            Ok::<_, SolveError>((motion, Some(slip)))
        };
        let (motions, slip, by_motion) = match problem.history {
            _ if self.curve.is_flat() => (self.plane_motions(contact, &field, origin)?, None, None),
            None => {
                let (motion, slip) = under(&problem.motions[0], slip)?;
                (vec![motion], slip, None)
            }
            Some(_) => {
                let (_, still) = under(&Motion::default(), slip)?;
                let unit = |creepage_y, spin_per_mm| Motion {
                    creepage_x: 0.0,
                    creepage_y,
                    spin_per_mm,
                };
                let (_, across) = under(&unit(1.0, 0.0), None)?;
                let (_, spin) = under(&unit(0.0, 1.0), None)?;
                (
                    problem.motions.clone(),
                    still,
                    across.zip(spin).map(<[_; 2]>::from),
                )
            }
        };
        let report = NormalReport {
            force_residual: contact.missed,
            ..contact.work.with_time(0.0)
        };
        let extents = loads.iter().map(|patch| patch.extent);
        let friction = self.friction_at(origin, extents);
        let unbalanced = match self.is_vertical() {
            true => tolerance(run.resolution),
            false => 0.0,
        };
        let load_error = contact.missed.hypot(unbalanced);
        let solved = SolvedFootprint {
            footprint: Footprint::computed(field.from_origin(origin), load_error).on_surface(
                slip,
                by_motion,
                centres.iter().map(|centre| minus(*centre, origin)),
            ),
            report: Some(report),
            coupling_error: open,
            remarks: Vec::new(),
        };
        let part = CheckedCase {
            problem: problem.of_gap(friction, motions),
            run: run.clone(),
            label: label.clone(),
            remarks: Vec::new(),
        };
        part.fits(&solved.footprint)?;
        let (solution, fields) = rolling_stage::solve(self.operators, &part, &solved, watch)?;
        Ok(Part {
            origin,
            loads: solved.footprint.patches().to_vec(),
            centres,
            solution,
            fields,
        })
    }

    /// Friction of patches with these extents `[x_min, x_max, s_min, s_max]` about an origin `[x, s]`, in mm.
    fn friction_at(
        &self,
        origin: [f64; 2],
        extents: impl Iterator<Item = [f64; 4]>,
    ) -> FrictionLaw {
        let friction = &self.case.problem.friction;
        let rail = |s| self.curve.at(s).rail;
        on_rail(friction, &self.contact.geometry, extents, origin, rail)
    }

    /// The motions of a plane about an origin `[x, s]` on it: those of the case, or from a wheelset the mean of those at the load centres of its patches,
    /// weighted with their forces.
    fn plane_motions(
        &self,
        contact: &CurveContact,
        field: &PressureField,
        origin: [f64; 2],
    ) -> Result<Vec<Motion>, SolveError> {
        let problem = &self.case.problem;
        let Some(wheelset) = &problem.wheelset else {
            return Ok(problem.motions.clone());
        };
        let rigid = RigidMotion::of_wheelset(&self.contact.geometry, contact.centre, wheelset);
        let patches = field.patches();
        let force: f64 = patches.iter().map(|patch| patch.normal_force).sum();
        let mut mean = Motion::default();
        for (k, patch) in patches.iter().enumerate() {
            let centre = field.load_centre(Some(k));
            let (place, over) = self.load_centre(contact, centre)?;
            let own = creepages(&rigid, centre[0], &place, &over);
            let [dx, ds] = minus(centre, origin);
            let share = patch.normal_force / force;
            mean.creepage_x += share * (own.creepage_x + own.spin_per_mm * ds);
            mean.creepage_y += share * (own.creepage_y - own.spin_per_mm * dx);
            mean.spin_per_mm += share * own.spin_per_mm;
        }
        Ok(vec![mean])
    }

    /// The place of a load centre `[x, s]` and the wheel over it.
    fn load_centre(
        &self,
        contact: &CurveContact,
        [x, s]: [f64; 2],
    ) -> Result<(CurvePlace, WheelOver), SolveError> {
        let place = self.curve.at(s);
        let nearest = self.curve.nearest(&place, contact.centre);
        let over =
            nearest.and_then(|(_, start)| self.curve.over(&place, x, contact.centre, &start));
        let over = over.ok_or_else(|| SolveError::NormalProblem {
            reason: format!(
                "the wheel's surface was not found over the place x = {x:.3} mm, s = {s:.3} mm of the rail"
            ),
        })?;
        Ok((place, over))
    }

    /// The motion of the wheel as a rigid body at each patch: the same at all if the case gives that of a wheelset, else the one with these creepages
    /// at its load centre.
    fn rigid(
        &self,
        contact: &CurveContact,
        field: &PressureField,
        creepages: &Motion,
    ) -> Result<Vec<RigidMotion>, SolveError> {
        let (problem, geometry) = (&self.case.problem, &self.contact.geometry);
        let patches = 0..field.patches().len();
        if let Some(wheelset) = &problem.wheelset {
            let motion = RigidMotion::of_wheelset(geometry, contact.centre, wheelset);
            return Ok(patches.map(|_| motion).collect());
        }
        let Motion {
            creepage_x,
            creepage_y,
            spin_per_mm,
        } = *creepages;
        let of = |patch: usize| {
            let centre = field.load_centre(Some(patch));
            let (place, over) = self.load_centre(contact, centre)?;
            let point = place.point(centre[0], over.gap);
            let creepages = [creepage_x, creepage_y, spin_per_mm];
            Ok(RigidMotion::of_creepages(point, &place, creepages))
        };
        patches.map(of).collect()
    }

    /// The slip of the surface beyond a motion about an origin `[x, s]`.
    ///
    /// The deformed surface of equal bodies lies halfway between the undeformed surfaces, that of other bodies nearer to the stiffer one. The rolling radius of a
    /// strip is taken there, less what the deepest strip loses, so that this one keeps the radius of the undeformed wheel, to which creepages refer. Along x half-spaces lack other terms of
    /// the size of the wheel's roundness, so that it is left out: a flat surface has the slip of a plane.
    fn surface_slip(
        &self,
        contact: &CurveContact,
        field: &PressureField,
        rigid: &[RigidMotion],
        of_pressure: Option<&[Vec<f64>; 2]>,
        origin: [f64; 2],
        motion: &Motion,
    ) -> SurfaceSlip {
        let grid = &contact.grid;
        let extents: Vec<[f64; 4]> = field.patches().iter().map(|patch| patch.extent).collect();
        let patch_of = |s: f64| {
            let far = |k: &usize| {
                let [.., low, high] = extents[*k];
                (low - s).max(s - high).max(0.0)
            };
            (0..extents.len()).min_by(|a, b| far(a).total_cmp(&far(b)))
        };
        let deepest = least(&contact.gap);
        let share = self.case.problem.elasticity.lower_share;
        let mut slip = [Vec::new(), Vec::new()];
        for (j, place) in grid.places.iter().enumerate() {
            let rigid = &rigid[patch_of(place.s).unwrap_or(0)];
            let row = &contact.gap[j * grid.x.len()..(j + 1) * grid.x.len()];
            let gap = (1.0 - share) * deepest + share * least(row).min(0.0);
            // It is linear in x.
            let [at, by_x] = [0.0, 1.0].map(|x| rigid.slip(place.point(x, gap), place));
            for (i, x) in grid.x.iter().enumerate() {
                let k = j * grid.x.len() + i;
                let own = [0, 1].map(|axis| at[axis] + x * (by_x[axis] - at[axis]));
                let [dx, ds] = [x - origin[0], place.s - origin[1]];
                let plane = [
                    motion.creepage_x - motion.spin_per_mm * ds,
                    motion.creepage_y + motion.spin_per_mm * dx,
                ];
                for (axis, slip) in slip.iter_mut().enumerate() {
                    let pressed = of_pressure.map_or(0.0, |of_pressure| of_pressure[axis][k]);
                    slip.push(own[axis] - plane[axis] + pressed);
                }
            }
        }
        SurfaceSlip {
            x: (grid.x[0] - origin[0], grid.step[0], grid.x.len()),
            y: grid
                .places
                .iter()
                .map(|place| place.s - origin[1])
                .collect(),
            slip,
        }
    }

    /// Forces in a motion of every patch of every part: of the pressures on the grid, and of the tractions, corrected to their extrapolated resultants.
    fn forces(
        &self,
        contact: &CurveContact,
        parts: &[Part],
        index: usize,
    ) -> Vec<Vec<PatchForces>> {
        let of_part = |part: &Part| {
            let field = part.solution.patches.iter().enumerate();
            let of_patch = |(k, patch): (usize, &PatchSolution)| {
                let mut forces = PatchForces {
                    pressed: self.pressed(contact, part, k),
                    ..PatchForces::default()
                };
                let (mut shear, mut plain) = ([0.0; 3], [0.0; 2]);
                each_cell(part, k, index, |place, _, area, [x, y, _]| {
                    let (sin, cos) = self.curve.at(place[1]).angle.sin_cos();
                    plain = [plain[0] + area * x, plain[1] + area * y];
                    shear[1] += area * y * cos;
                    shear[2] += area * y * sin;
                });
                let (sin, cos) = forces.angle().sin_cos();
                let point = &patch.points[index];
                let beyond = point.force_y_n - plain[1];
                forces.sheared = [
                    point.force_x_n,
                    shear[1] + beyond * cos,
                    shear[2] + beyond * sin,
                ];
                forces
            };
            field.map(of_patch).collect()
        };
        parts.iter().map(of_part).collect()
    }

    /// Pressures of a patch times the sine and the cosine of their angles, in N.
    fn pressed(&self, contact: &CurveContact, part: &Part, patch: usize) -> [f64; 2] {
        let grid = &contact.grid;
        let [x_min, x_max, s_min, s_max] = part.solution.patches[patch].extent_mm;
        let alone = part.solution.patches.len() == 1 && contact.parts(self.influence).len() == 1;
        let mut sums = [0.0; 2];
        for (j, place) in grid.places.iter().enumerate() {
            let s = place.s - part.origin[1];
            let row = &contact.pressure[j * grid.x.len()..(j + 1) * grid.x.len()];
            if !alone && !(s_min - grid.step[1]..=s_max + grid.step[1]).contains(&s) {
                continue;
            }
            let inside = |x: f64| {
                let x = x - part.origin[0];
                alone || (x_min - grid.step[0]..=x_max + grid.step[0]).contains(&x)
            };
            let cells = grid.x.iter().zip(row).filter(|(x, _)| inside(**x));
            let load: f64 = cells.map(|(_, p)| p).sum();
            let (sin, cos) = place.angle.sin_cos();
            sums = [sums[0] + load * sin, sums[1] + load * cos];
        }
        sums.map(|sum| sum * grid.area())
    }

    /// Tractions of a motion on the cells of the grid in MPa, with the same forces.
    fn on_grid(&self, contact: &CurveContact, parts: &[Part], index: usize) -> [Vec<f64>; 2] {
        let grid = &contact.grid;
        let [nx, ny] = grid.cells();
        let mut traction = [vec![0.0; nx * ny], vec![0.0; nx * ny]];
        let low = [
            grid.x[0] - 0.5 * grid.step[0],
            grid.places[0].s - 0.5 * grid.step[1],
        ];
        let cells = [nx, grid.numbers[ny - 1] + 1];
        for part in parts {
            for k in 0..part.solution.patches.len() {
                each_cell(part, k, index, |place, size, _, [x, y, _]| {
                    // The cells that it covers, and the part of each.
                    let [along, across] = [0, 1].map(|axis| {
                        let ends = [-0.5, 0.5].map(|half| {
                            (place[axis] + half * size[axis] - low[axis]) / grid.step[axis]
                        });
                        covered(ends, cells[axis])
                    });
                    for (number, height) in &across {
                        let Some(j) = grid.strip(*number as i64) else {
                            continue;
                        };
                        for (i, width) in &along {
                            let share = width * height;
                            traction[0][j * nx + i] += share * x;
                            traction[1][j * nx + i] += share * y;
                        }
                    }
                });
            }
        }
        traction
    }

    /// What the factors for the turn leave open of a force, relative to the friction limit.
    fn left_open(&self, contact: &CurveContact) -> f64 {
        if !self.is_corrected() {
            return 0.0;
        }
        let [_, deviation] = contact.angles();
        let unequal = (2.0 * self.case.problem.elasticity.lower_share - 1.0).abs();
        (1.0 + OPEN_BY_UNEQUAL * unequal) * (OPEN_BY_TURN * deviation).min(OPEN_MAX)
    }

    /// Fails where a profile ends beside a patch, or the rail turns away from a plane.
    fn check_ends(&self, contact: &CurveContact) -> Result<(), SolveError> {
        let beyond = contact.grid.step[1];
        let known = self.curve.range();
        for [first, last] in contact.grid.runs(&contact.pressure) {
            let [low, high] = [first, last].map(|j| contact.grid.places[j].s);
            for s in [low - beyond, high + beyond] {
                let place = self.curve.at(s);
                let on_rail = (known[0]..=known[1]).contains(&s);
                if on_rail && self.curve.nearest(&place, contact.centre).is_some() {
                    continue;
                }
                let [y, _] = self.contact.geometry.on_rail(place.rail);
                return Err(SolveError::NormalProblem {
                    reason: format!(
                        "the contact at y = {y:.1} mm on the rail reaches the end of a profile, where it may be cut off; longer profiles are needed"
                    ),
                });
            }
        }
        Ok(())
    }

    /// The patches with their places on both bodies.
    fn patches(&self, contact: &CurveContact) -> Result<Vec<WheelPatch>, SolveError> {
        let mut patches = Vec::new();
        for strips in contact.parts(self.influence) {
            let field = CurveContact::field(contact.patches(strips)?)?;
            for (number, patch) in field.patches().into_iter().enumerate() {
                let centre = field.load_centre(Some(number));
                let (place, wheel) = self.load_centre(contact, centre)?;
                let [.., low, high] = patch.extent;
                let end = |s: f64| {
                    let place = self.curve.at(s);
                    let over = self.curve.nearest(&place, contact.centre);
                    [place.rail, over.map_or(wheel.wheel, |(_, over)| over.wheel)]
                };
                patches.push(WheelPatch {
                    x: centre[0],
                    place,
                    wheel,
                    ends: [low, high].map(end),
                    field: field.clone().from_origin(centre),
                    number,
                });
            }
        }
        Ok(patches)
    }

    /// The wheel at rest.
    fn wheel(&self, contact: &CurveContact) -> Result<WheelContact, SolveError> {
        let patches = self.patches(contact)?;
        self.check_ends(contact)?;
        let slender = patches.iter().map(WheelPatch::patch).find(|patch| {
            let [rear, front, low, high] = patch.extent;
            patch.normal_force > SLENDER_SHARE * contact.normal_force()
                && front - rear > SLENDER_MAX * (high - low)
        });
        if let Some(Patch { extent, .. }) = slender.filter(|_| !self.curve.is_flat()) {
            let [rear, front, low, high] = extent;
            return Err(SolveError::NormalProblem {
                reason: format!(
                    "a patch on the curve of the rail is {} mm long and {} mm wide, more than {SLENDER_MAX} times as long as wide, as on a ridge; \
                     smooth the profiles, or give reference_surface \"plane\"",
                    short(front - rear),
                    short(high - low)
                ),
            });
        }
        Ok(WheelContact {
            lowering: self.touch - contact.centre,
            centre: contact.centre,
            patches,
            remarks: Vec::new(),
        })
    }

    /// The answer of all parts.
    fn answer(
        &self,
        found: Found,
        wheel: &WheelContact,
        seconds: f64,
    ) -> Result<(Solution, Fields), SolveError> {
        let Found {
            contact,
            parts,
            changes,
        } = found;
        let left_open = self.left_open(&contact);
        let of_motions: Vec<_> = (0..changes.len())
            .map(|index| self.forces(&contact, &parts, index))
            .collect();
        let mut remarks = self.case.remarks.clone();
        remarks.extend(wheel.remarks.iter().cloned());
        let centre = load_centre_of_all(self.curve, &parts);
        let nothing = Total {
            force_x_n: 0.0,
            force_y_n: 0.0,
            force_z_n: Some(0.0),
            moment_z_n_mm: 0.0,
            error_estimate: Some(ErrorEstimate::default()),
            profile_uncertainty: None,
        };
        let mut totals = vec![nothing; changes.len()];
        let mut whole: Option<(Solution, Fields)> = None;
        for (number, mut part) in parts.into_iter().enumerate() {
            let first = whole.as_ref().map_or(0, |(whole, _)| whole.patches.len());
            remarks.extend(part.solution.remarks.iter().map(|remark| RemarkEntry {
                patch: remark.patch.map(|patch| patch + first),
                ..remark.clone()
            }));
            for (index, total) in totals.iter_mut().enumerate() {
                part.leave_open(index, left_open + changes[index]);
                let error = self.error_of(&part, index, centre);
                total.error_estimate = total.error_estimate.zip(error).map(|(a, b)| a.plus(b));
            }
            for k in 0..part.loads.len() {
                let forces: Vec<PatchForces> =
                    of_motions.iter().map(|forces| forces[number][k]).collect();
                for (index, total) in totals.iter_mut().enumerate() {
                    let [x, y, z] = forces[index].in_track();
                    total.force_x_n += x;
                    total.force_y_n += y;
                    total.force_z_n = total.force_z_n.map(|sum| sum + z);
                    total.moment_z_n_mm += self.moment(&part, k, index, centre);
                }
                self.add_patch(&contact, &mut part, k, &forces)?;
            }
            match &mut whole {
                None => whole = Some((part.solution, part.fields)),
                Some((all, fields)) => {
                    all.normal = all.normal.zip(part.solution.normal).map(|(a, b)| a.with(b));
                    all.patches.extend(part.solution.patches);
                    fields.patches.extend(part.fields.patches);
                }
            }
        }
        let Some((mut solution, mut fields)) = whole else {
            unreachable!("a wheel at rest touches its rail")
        };
        drop_unasked(&self.case.run, &mut fields);
        if let Some(normal) = &mut solution.normal {
            normal.seconds = seconds;
        }
        let solution = Solution {
            total: totals,
            remarks: merged(remarks),
            wheel_lowering_mm: Some(wheel.lowering),
            origin: Origin {
                x_mm: centre[0],
                y_mm: centre[1],
                meaning: "load centre of all patches in track axes, for the total; the origin of a patch is in its position"
                    .to_owned(),
            },
            frame: FRAME.to_owned(),
            ..solution
        };
        Ok((solution, fields))
    }

    /// The moment of a patch in a motion about the vertical line through a point `[x, y]` of the track.
    fn moment(&self, part: &Part, k: usize, index: usize, about: [f64; 2]) -> f64 {
        let mut moment = 0.0;
        each_cell(part, k, index, |cell, _, area, [q_x, q_s, p]| {
            let place = self.curve.at(cell[1]);
            let (sin, cos) = place.angle.sin_cos();
            let across = q_s * cos + p * sin;
            moment += area * ((cell[0] - about[0]) * across - (place.at[0] - about[1]) * q_x);
        });
        moment
    }

    /// Completes a patch with its position, and in every motion with its force at its mean angle and the motion at its load centre.
    fn add_patch(
        &self,
        contact: &CurveContact,
        part: &mut Part,
        k: usize,
        forces: &[PatchForces],
    ) -> Result<(), SolveError> {
        let geometry = &self.contact.geometry;
        let centre = part.centres[k];
        let (place, over) = self.load_centre(contact, centre)?;
        let [_, y, z] = place.point(centre[0], 0.0);
        let by = minus(part.centres[k], part.origin);
        move_origin(
            &mut part.solution.patches[k],
            part.fields.patches.get_mut(k),
            by,
        );
        let load = part.loads[k];
        let patch = &mut part.solution.patches[k];
        let limit = patch.friction_limit_n.unwrap_or(0.0);
        // Pressures are those of all motions.
        let angle = forces[0].angle();
        patch.position = Some(Position {
            track_mm: [centre[0], y, z],
            rail_mm: geometry.on_rail(place.rail),
            wheel_mm: geometry.on_wheel(over.wheel),
            contact_angle_rad: angle,
            rolling_radius_mm: geometry.meridian(over.wheel).radius,
            origin_track_mm: [centre[0], y, z],
        });
        patch.approach_mm = load.approach;
        let problem = &self.case.problem;
        let (sin, cos) = angle.sin_cos();
        let points = patch.points.iter_mut().zip(forces);
        for ((point, forces), speed) in points.zip(&problem.speeds) {
            if let Some(wheelset) = &problem.wheelset {
                let rigid = RigidMotion::of_wheelset(geometry, contact.centre, wheelset);
                let motion = creepages(&rigid, centre[0], &place, &over);
                point.motion = motion.into();
                point.normalised = normalised(&problem.elasticity, patch.area_mm2, limit, &motion);
            }
            let [along, y_share, z_share] = forces.sheared;
            point.force_y_n = y_share * cos + z_share * sin;
            point.force_track_n = Some(forces.in_track());
            point.friction_power_without_spin_n = (point.motion.creepage_x * along).abs()
                + (point.motion.creepage_y * point.force_y_n).abs();
            if let Some(task) = &self.case.run.after.damage {
                let across = point.damage.take().and_then(|damage| damage.across);
                let of = DamagedPatch {
                    patch: &load,
                    point,
                    limit,
                    speed: *speed,
                };
                point.damage = Some(Box::new(Damage {
                    across,
                    ..damage(task, of)
                }));
            }
        }
        Ok(())
    }

    /// The errors of the forces of a part in a motion in track axes, and of its moment about the vertical line through a point `[x, y]`.
    fn error_of(&self, part: &Part, index: usize, about: [f64; 2]) -> Option<ErrorEstimate> {
        let [x, s] = part.origin;
        let arm = [x - about[0], self.curve.at(s).at[0] - about[1]];
        let error = part.solution.total[index].error_estimate?;
        Some(ErrorEstimate {
            moment_z_n_mm: error.moment_z_n_mm
                + arm[0].abs() * error.force_y_n
                + arm[1].abs() * error.force_x_n,
            ..error
        })
    }
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

/// The friction to count on next: what was found, with a secant step for the vertical force.
fn accelerated(counted: &Friction, found: Friction, earlier: &mut Option<(f64, f64)>) -> Friction {
    let pair = (counted.lift, found.lift);
    Friction {
        lift: next_share(pair, earlier.replace(pair)),
        ..found
    }
}

/// A run with tractions and pressures among its outputs.
fn with_tractions(run: &Run, outputs: &[Output]) -> Run {
    let needed = [Output::Resultants, Output::Tractions, Output::Pressure];
    let mut outputs: Vec<Output> = outputs.iter().copied().chain(needed).collect();
    outputs.sort_unstable();
    outputs.dedup();
    Run {
        outputs,
        ..run.clone()
    }
}

/// Removes values per cell that were not asked for.
fn drop_unasked(run: &Run, fields: &mut Fields) {
    let kept = |output| run.wants(output);
    if !run.outputs.iter().any(|output| output.is_per_cell()) {
        fields.patches.clear();
        return;
    }
    for PatchFields { meshes, points } in &mut fields.patches {
        if !kept(Output::Pressure) {
            meshes
                .iter_mut()
                .for_each(|cells| cells.pressure_mpa = None);
        }
        if !kept(Output::Tractions) {
            for point in points {
                (point.traction_x_mpa, point.traction_y_mpa) = (None, None);
            }
        }
    }
}

/// Creepages and spin at a place, at x in mm.
fn creepages(rigid: &RigidMotion, x: f64, place: &CurvePlace, over: &WheelOver) -> Motion {
    let [creepage_x, creepage_y] = rigid.slip(place.point(x, over.gap), place);
    Motion {
        creepage_x,
        creepage_y,
        spin_per_mm: rigid.spin(place),
    }
}

/// Calls with the place `[x, s]`, the size and the area of every cell of a patch, in mm and mm², and with its pressure and its tractions in a motion in
/// MPa.
fn each_cell(
    part: &Part,
    patch: usize,
    index: usize,
    mut call: impl FnMut([f64; 2], [f64; 2], f64, [f64; 3]),
) {
    let Some(fields) = part.fields.patches.get(patch) else {
        return;
    };
    let (cells, point) = (fields.cells(index), &fields.points[index]);
    let (Some(x), Some(y), Some(p)) = (
        &point.traction_x_mpa,
        &point.traction_y_mpa,
        &cells.pressure_mpa,
    ) else {
        return;
    };
    for i in 0..cells.x_mm.len() {
        let place = [
            cells.x_mm[i] + part.origin[0],
            cells.y_mm[i] + part.origin[1],
        ];
        let size = [cells.dx_mm[i], cells.dy_mm[i]];
        call(place, size, size[0] * size[1], [x[i], y[i], p[i]]);
    }
}

/// Cells between two places counted in cells, with the part of each that lies between.
fn covered([from, to]: [f64; 2], cells: usize) -> Vec<(usize, f64)> {
    let [first, last] = [from, to].map(|end| (end.max(0.0).floor() as usize).min(cells - 1));
    let part = |cell: usize| to.min(cell as f64 + 1.0) - from.max(cell as f64);
    (first..=last)
        .map(|cell| (cell, part(cell)))
        .filter(|(_, part)| *part > 0.0)
        .collect()
}

/// Pressures times the sine and the cosine of the angles of their strips, in N.
fn resultant(contact: &CurveContact) -> [f64; 2] {
    let rows = contact.pressure.chunks_exact(contact.grid.x.len());
    let rows = rows.zip(&contact.grid.places);
    let sum = rows.fold([0.0; 2], |sum, (row, place)| {
        let (load, (sin, cos)) = (row.iter().sum::<f64>(), place.angle.sin_cos());
        [sum[0] + load * sin, sum[1] + load * cos]
    });
    sum.map(|sum| sum * contact.grid.area())
}

/// The friction limit of some parts in N.
fn limit(parts: &[Part]) -> f64 {
    let patches = parts.iter().flat_map(|part| &part.solution.patches);
    patches.filter_map(|patch| patch.friction_limit_n).sum()
}

/// How many patches some parts have.
fn count(parts: &[Part]) -> usize {
    parts.iter().map(|part| part.loads.len()).sum()
}

/// The least of some gaps in mm.
fn least(gaps: &[f64]) -> f64 {
    gaps.iter().copied().fold(f64::INFINITY, f64::min)
}

/// The turn of the surface from the first to the last strip in contact, in rad.
fn turn(contact: &CurveContact) -> f64 {
    let nx = contact.grid.x.len();
    let rows = contact.pressure.chunks_exact(nx).zip(&contact.grid.places);
    let touching = rows.filter(|(row, _)| row.iter().any(|p| *p > 0.0));
    let nothing = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = touching.fold(nothing, |[low, high], (_, place)| {
        [low.min(place.angle), high.max(place.angle)]
    });
    (high - low).max(0.0)
}

/// Mean place `[x, y]` of all patches in track axes, weighted with their normal forces.
fn load_centre_of_all(curve: &ReferenceCurve, parts: &[Part]) -> [f64; 2] {
    let (mut load, mut sum) = (0.0, [0.0; 2]);
    for part in parts {
        for k in 0..part.solution.patches.len() {
            each_cell(part, k, 0, |[x, s], _, area, [.., p]| {
                load += area * p;
                sum = [sum[0] + area * p * x, sum[1] + area * p * curve.at(s).at[0]];
            });
        }
    }
    sum.map(|sum| sum / load.max(f64::MIN_POSITIVE))
}
