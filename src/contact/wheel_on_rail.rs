//! The contact of a wheel and a rail.
//!
//! The pressures depend on the height of the wheel, because friction carries a part of the load, and on the gap that tractions open. The tractions
//! depend on the pressures and on the slip that these cause. [`rounds`] solves both in turn until they agree. The coordinates of the surface are x
//! and the arc length s of the rail's cross-section. The rigid slip of a point is that of the wheel's undeformed surface above it.
//!
//! Planes of contact replace parts of the curve. The tractions of each plane are solved separately, under the slip of a plane and by any method.
//! On planes, pressures depend on tractions only under a vertical load. Under other loads several motions share the pressures.

use std::sync::Arc;

use crate::error::SolveError;
use crate::geometry::contact_locus::ContactLocus;
use crate::geometry::reference_curve::{CurvePlace, ReferenceCurve, WheelOver};
use crate::half_space::bent_surface::{Influence, TURN_MAX};
use crate::monitor::{Monitor, MonitorPart};
use crate::normal::gap::grid::{GridFineness, SHARE_MIN};
use crate::normal::hertz::Patch;
use crate::normal::on_curve::{CurveContact, CurveTask, Friction, STEEP, Workspace};
use crate::normal::wheel::{ReferenceSurface, WheelContact, WheelLoad, WheelPatch, WheelTask};
use crate::problem::checked_case::CheckedCase;
use crate::problem::physics::negligible;
use crate::remark::entry::RemarkEntry;
use crate::remark::kind::short;
use crate::remark::list::Remark;
use crate::rolling::operator_store::OperatorStore;
use crate::slices::joined;
use crate::solution::words::answer::{Fields, Solution};
use crate::time_limit::TimeLimit;
use crate::unlike_bodies::tell_region;
use crate::wheel_on_rail::answer::turn;

mod answer;
mod rounds;
mod tractions;

/// Largest ratio of length to width of a patch. Hertz's patch of a gauge corner of 13 mm is 11 times as long as wide, a contact at the root of a
/// flange 20 times. A single displaced point makes a ridge a hundred times as long as wide.
const SLENDER_MAX: f64 = 40.0;

/// The wheel in equilibrium, with the answer for all its patches.
pub(crate) struct SolvedWheel {
    pub(crate) wheel: WheelContact,
    pub(crate) solution: Solution,
    pub(crate) fields: Fields,
}

/// Called with a wheel in equilibrium before its motions are solved. An error ends the solve.
pub(crate) type BeforeMotions<'a> = dyn FnMut(&WheelContact) -> Result<(), SolveError> + 'a;

/// The reference surface of a contact, and the influence of its strips on each other.
struct Surface<'a> {
    curve: ReferenceCurve<'a>,
    influence: Influence,
}

/// Solves a wheel on a rail.
///
/// If tractions change the pressures, on the curve and on planes under a vertical load, every motion has its own pressures. Then `before` is called
/// once, with the wheel without tractions, and the returned wheel and patches are those of the first motion. All points of a history have the
/// pressures of its last point.
///
/// # Errors
/// Returns the reason why there is no answer.
pub(crate) fn solve(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    contact: &WheelTask,
    before: &mut BeforeMotions,
    monitor: &dyn Monitor,
) -> Result<SolvedWheel, SolveError> {
    let motions = case.problem.motions.len();
    let on_curve = contact.surface != ReferenceSurface::Planes;
    let each = case.problem.history.is_none() && (on_curve || friction_lifts(case, contact));
    let at_rest = match each && case.problem.part.all > 1 {
        true => Some(at_rest(case, contact, before, monitor)?),
        false => None,
    };
    let together = if each { 1 } else { motions };
    let mut first = None;
    let answers = (0..motions).step_by(together).map(|index| {
        let part = case.slice(index..index + together);
        let share = MonitorPart::new(
            monitor,
            index as f64 / motions as f64,
            together as f64 / motions as f64,
        );
        let watch = TimeLimit::new(&share, case.run.time_limit, 1);
        let solved = match &at_rest {
            Some(at_rest) => one_of_several(operators, &part, contact, at_rest, &watch),
            None => surface(&part, contact, true, &watch).and_then(|surface| {
                WheelSolve::new(operators, &part, contact, &surface, &watch)?.motions(true, before)
            }),
        };
        let solved = solved.map_err(|error| watch.explained(error, &part))?;
        first.get_or_insert(solved.wheel);
        Ok::<_, SolveError>((solved.solution, solved.fields))
    });
    let (solution, fields) = joined(answers)?;
    let Some(wheel) = first else {
        unreachable!("a case has at least one motion")
    };
    Ok(SolvedWheel {
        wheel,
        solution,
        fields,
    })
}

/// Solves one of several motions. All motions of an answer have the same number of patches. If tractions change this number, or if there is no
/// answer with them, the pressures without tractions are used.
fn one_of_several(
    operators: &Arc<OperatorStore>,
    part: &CheckedCase,
    contact: &WheelTask,
    at_rest: &WheelAtRest,
    watch: &TimeLimit,
) -> Result<SolvedWheel, SolveError> {
    let asked: &mut BeforeMotions = &mut |_| Ok(());
    let own = surface(part, contact, true, watch).and_then(|surface| {
        WheelSolve::new(operators, part, contact, &surface, watch)?.motions(true, asked)
    });
    let mut solved = match own {
        Ok(solved) if solved.wheel.patches.len() == at_rest.patches => solved,
        Ok(_) | Err(SolveError::NormalProblem { .. }) => {
            let solve = WheelSolve::new(operators, part, contact, &at_rest.surface, watch)?;
            solve.motions(false, asked)?
        }
        Err(error) => return Err(error),
    };
    solved.solution.patches.iter_mut().for_each(tell_region);
    Ok(solved)
}

/// Returns whether the load is a vertical force, of which friction carries a part.
fn friction_lifts(case: &CheckedCase, contact: &WheelTask) -> bool {
    let frictionless = case.problem.friction.is_frictionless();
    matches!(contact.loading, WheelLoad::Vertical(_)) && !frictionless
}

/// Finds the reference surface of a contact. Planes are placed at the height of the wheel without tractions, or with those of the last motion if
/// `with_friction`.
fn surface<'a>(
    case: &CheckedCase,
    contact: &'a WheelTask,
    with_friction: bool,
    monitor: &dyn Monitor,
) -> Result<Surface<'a>, SolveError> {
    let curve = ReferenceCurve::new(&contact.geometry);
    if let ReferenceSurface::Curve { influence, .. } = contact.surface {
        return Ok(Surface { curve, influence });
    }
    let locus = ContactLocus::new(&contact.geometry).map_err(SolveError::normal_problem)?;
    let of_curve = Surface {
        curve,
        influence: Influence::HalfSpace,
    };
    let on_planes = |loading: WheelLoad| {
        let contact = coarse(case, contact, &of_curve, loading, monitor)?;
        let planes = contact.planes(&of_curve.curve, &locus);
        Ok::<_, SolveError>(Surface {
            curve: of_curve.curve.on_planes(planes),
            influence: Influence::HalfSpace,
        })
    };
    let flat = on_planes(contact.loading)?;
    if !with_friction || !friction_lifts(case, contact) {
        return Ok(flat);
    }
    let operators = Arc::default();
    let watch = TimeLimit::new(monitor, case.run.time_limit, 1);
    let solve = WheelSolve::new(&operators, case, contact, &flat, &watch)?;
    let (_, found) = solve.coarse(true, &mut Workspace::default())?;
    on_planes(WheelLoad::Lowering(solve.touch - found.centre))
}

/// The contact of a wheel on the curve of its rail without tractions, on a coarse grid.
fn coarse(
    case: &CheckedCase,
    contact: &WheelTask,
    surface: &Surface,
    loading: WheelLoad,
    monitor: &dyn Monitor,
) -> Result<CurveContact, SolveError> {
    let watch = TimeLimit::new(monitor, case.run.time_limit, 1);
    let operators = Arc::default();
    let solve = WheelSolve::new(&operators, case, contact, surface, &watch)?;
    let task = CurveTask {
        loading,
        ..solve.task()
    };
    let found = task.coarse(&mut Workspace::default(), &watch);
    found.map_err(|failure| watch.explained(failure.into(), case))
}

/// Estimates the largest pressure in MPa of the patch with the largest load.
///
/// # Errors
/// Returns an error if the wheel has no equilibrium on the rail or the monitor stopped the work.
pub(crate) fn largest_pressure(
    case: &CheckedCase,
    contact: &WheelTask,
    monitor: &dyn Monitor,
) -> Result<f64, SolveError> {
    let of_curve = Surface {
        curve: ReferenceCurve::new(&contact.geometry),
        influence: Influence::HalfSpace,
    };
    Ok(coarse(case, contact, &of_curve, contact.loading, monitor)?.main_pressure())
}

/// Finds the equilibrium of a wheel without tractions.
///
/// # Errors
/// Returns the reason why the wheel has no equilibrium, or the error of `before`.
pub(crate) fn at_rest<'a>(
    case: &CheckedCase,
    contact: &'a WheelTask,
    before: &mut BeforeMotions,
    monitor: &dyn Monitor,
) -> Result<WheelAtRest<'a>, SolveError> {
    let surface = surface(case, contact, false, monitor)?;
    let watch = TimeLimit::new(monitor, case.run.time_limit, 1);
    let operators = Arc::default();
    let solve = WheelSolve::new(&operators, case, contact, &surface, &watch)?;
    let workspace = &mut Workspace::default();
    let task = solve.task();
    let coarse = task.coarse(workspace, &watch);
    let found = coarse
        .and_then(|coarse| task.fine(&coarse, &Friction::default(), workspace, &watch))
        .map_err(|failure| watch.explained(failure.into(), case))?;
    let wheel = solve.wheel(&found)?;
    before(&wheel)?;
    Ok(WheelAtRest {
        patches: wheel.patches.len(),
        surface,
    })
}

/// The equilibrium of a wheel without tractions: its reference surface and the number of its patches.
pub(crate) struct WheelAtRest<'a> {
    surface: Surface<'a>,
    patches: usize,
}

/// The solve of a wheel on a rail in one motion, or in motions that share its pressures.
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

impl<'a> WheelSolve<'a> {
    fn new(
        operators: &'a Arc<OperatorStore>,
        case: &'a CheckedCase,
        contact: &'a WheelTask,
        surface: &'a Surface<'a>,
        watch: &'a TimeLimit<'a>,
    ) -> Result<WheelSolve<'a>, SolveError> {
        let [touch, expected] = contact.first_touch().map_err(SolveError::normal_problem)?;
        Ok(WheelSolve {
            operators,
            case,
            contact,
            influence: surface.influence,
            curve: &surface.curve,
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

    /// Solves the motions, with the pressures that belong to the tractions of the last motion, or without tractions.
    fn motions(
        &self,
        with_friction: bool,
        before: &mut BeforeMotions,
    ) -> Result<SolvedWheel, SolveError> {
        let began = self.watch.elapsed();
        let (mut wheel, found) = self.rounds(with_friction, before, &mut Workspace::default())?;
        let rest = (self.watch.elapsed() - began).as_secs_f64();
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
        if !with_friction {
            let remark = Remark::NormalForcesAloneBalance {};
            wheel.remarks.push(remark.into());
            wheel.remarks.extend(self.first_order());
        }
        let problem = &self.case.problem;
        if problem.part.all > problem.motions.len() {
            let of_motion = |remark: &mut RemarkEntry| remark.point = Some(problem.part.before);
            wheel.remarks.iter_mut().for_each(of_motion);
        }
        let (solution, fields) = self.answer(found, &wheel, rest)?;
        Ok(SolvedWheel {
            wheel,
            solution,
            fields,
        })
    }

    /// Returns whether the influence is corrected for the turn of the surface.
    fn is_corrected(&self) -> bool {
        self.influence == Influence::AngleCorrected
    }

    fn is_vertical(&self) -> bool {
        friction_lifts(self.case, self.contact)
    }

    /// The remark that the effect of tractions on pressures is neglected, if the bodies differ enough for it to matter.
    fn first_order(&self) -> Option<RemarkEntry> {
        let CheckedCase { problem, run, .. } = self.case;
        let matters = problem.first_order_error(run.method) > negligible(run);
        matters.then(|| problem.first_order_remark(run.method).into())
    }

    /// The point of the curve at a load centre `[x, s]`, and the wheel above it.
    fn load_centre(
        &self,
        contact: &CurveContact,
        [x, s]: [f64; 2],
    ) -> Result<(CurvePlace, WheelOver), SolveError> {
        let place = self.curve.at(s);
        let nearest = self.curve.nearest(&place, contact.centre);
        let over =
            nearest.and_then(|(_, start)| self.curve.over(&place, x, contact.centre, &start));
        let over = over.ok_or_else(|| SolveError::normal_problem(format!(
                "the wheel's surface was not found above the position x = {x:.3} mm, s = {s:.3} mm of the rail"
            )))?;
        Ok((place, over))
    }

    /// Fails if a profile ends next to a patch, or the rail turns away from a plane there.
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
                return Err(SolveError::normal_problem(format!(
                    "the contact at y = {y:.1} mm on the rail reaches the end of a profile, where it may be cut off; longer profiles are needed"
                )));
            }
        }
        Ok(())
    }

    /// The patches with their positions on both bodies. Without `edges`, they end at their outermost samples.
    fn patches(&self, contact: &CurveContact, edges: bool) -> Result<Vec<WheelPatch>, SolveError> {
        let mut patches = Vec::new();
        for strips in contact.parts(self.influence) {
            let field = CurveContact::field(contact.patches(strips, edges)?)?;
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

    /// The wheel in equilibrium.
    fn wheel(&self, contact: &CurveContact) -> Result<WheelContact, SolveError> {
        let patches = self.patches(contact, true)?;
        self.check_ends(contact)?;
        // On a steep face, the wheel's curvature along x decreases with the cosine of the angle.
        let slender_max = |angle: f64| {
            let steep = STEEP / angle.cos().clamp(f64::MIN_POSITIVE, STEEP);
            SLENDER_MAX * steep.powf(2.0 / 3.0)
        };
        let slender = patches.iter().find_map(|on_rail| {
            let Patch {
                extent: [rear, front, low, high],
                normal_force,
                ..
            } = on_rail.patch();
            let (length, width, most) =
                (front - rear, high - low, slender_max(on_rail.place.angle));
            let counts = normal_force > SHARE_MIN * contact.normal_force();
            (counts && length > most * width).then_some([length, width, most])
        });
        if let Some([length, width, most]) = slender.filter(|_| !self.curve.is_flat()) {
            return Err(SolveError::normal_problem(format!(
                "a patch on the curve of the rail is {} mm long and {} mm wide, more than {most:.0} times as long as wide, as on a ridge; \
                     smooth the profiles, or give reference_surface \"plane\"",
                short(length),
                short(width)
            )));
        }
        Ok(WheelContact {
            lowering: self.touch - contact.centre,
            centre: contact.centre,
            patches,
            remarks: Vec::new(),
        })
    }
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}
