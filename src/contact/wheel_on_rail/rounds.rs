//! Fixed-point iteration between the pressures and the tractions of a wheel on a rail.

use crate::error::SolveError;
use crate::geometry::reference_curve::RigidMotion;
use crate::normal::gap::grid::NormalError;
use crate::normal::on_curve::{CurveContact, Friction, Workspace};
use crate::normal::wheel::{WheelContact, WheelPatch};
use crate::problem::checked_case::CheckedCase;
use crate::remark::list::Remark;
use crate::rolling::answer::Resultants;
use crate::rolling::task::NEGLIGIBLE_OF_TARGET;
use crate::traction_estimate::{can_estimate, patch_forces};
use crate::unlike_bodies::LEFT_BY_PRESSURE;
use crate::vertical_equilibrium::{next_share, tolerance};
use crate::wheel_on_rail::tractions::{Part, creepages};
use crate::wheel_on_rail::{BeforeMotions, WheelSolve, minus};

/// Target error of the resultants relative to μN on the coarse grid. It leads to the coarsest meshes.
const TARGET_ROUGH: f64 = 0.2;
/// Most rounds; 3 to 6 suffice.
const ROUNDS_MAX: u32 = 16;
/// Relative error of the gap that tractions open if they are taken as proportional to the pressure.
const OPENED_ERROR: f64 = 0.3;
/// Change that ends the rounds on the coarse grid: of the vertical force, and with tractions of the forces relative to μN. The step after it leaves about a fiftieth
/// of this.
const CHANGE_ROUGH: f64 = 0.02;
/// Largest change of the forces, relative to μN, that is accepted with a remark after the last round. It is part of the error estimate. If a strip
/// at the edge of a patch comes and goes with the tractions, these jump by the error of their mesh, and the rounds do not converge.
const CHANGE_POOR: f64 = 0.03;

/// The result of the rounds.
pub(super) struct Found {
    pub(super) contact: CurveContact,
    pub(super) parts: Vec<Part>,
    /// Changes of each motion if its tractions and the pressures agreed: of the forces relative to μN, and of the pressures relative to them.
    pub(super) changes: Vec<[f64; 2]>,
}

/// The neglected effect of tractions on the pressures.
struct Neglected {
    /// Changes of each motion: of the forces relative to μN, and of the pressures by the vertical force, relative to them.
    changes: Vec<[f64; 2]>,
    /// The largest change of the vertical force by friction, relative to it.
    by_lift: f64,
}

impl WheelSolve<'_> {
    /// Solves pressures and tractions in turn: first on a coarse grid until friction is known roughly, then on the fine one. `before` is called with
    /// the wheel in equilibrium on the fine grid. Unless `with_friction`, tractions are solved once, with the pressures without tractions.
    pub(super) fn rounds(
        &self,
        with_friction: bool,
        before: &mut BeforeMotions,
        workspace: &mut Workspace,
    ) -> Result<(WheelContact, Found), SolveError> {
        let run = &self.case.run;
        let problem = &self.case.problem;
        let of_gap = self.is_corrected() || problem.elasticity.difference != 0.0;
        let coupled = with_friction
            && (self.is_vertical() || of_gap && !self.curve.is_flat())
            && !problem.friction.is_frictionless();
        let task = self.task();
        let (mut friction, coarse) = self.coarse(coupled, workspace)?;
        let opens = friction.opened.is_some();
        let mut contact = task.fine(&coarse, &friction, workspace, self.watch)?;
        friction.opened.clone_from(&contact.opened);
        let first = self.wheel(&contact)?;
        before(&first)?;
        let target = run.resolution.target_or_usual();
        let negligible = NEGLIGIBLE_OF_TARGET * target;
        let balance = tolerance(run.resolution);
        let open = match with_friction && !self.curve.is_flat() {
            true => LEFT_BY_PRESSURE * problem.elasticity.difference.abs(),
            false => problem.first_order_error(run.method),
        };
        let last = problem.motions.len() - 1;
        let mut earlier = None;
        for round in 1..=ROUNDS_MAX {
            let parts = self.tractions(&contact, run, open, workspace)?;
            let (mut next, mut change) = (Friction::default(), 0.0);
            if coupled {
                next = match opens {
                    true => self.friction(&contact, &parts, last, workspace),
                    false => Friction {
                        lift: self.lift(&contact, &parts, last),
                        opened: None,
                    },
                };
                let [by_lift, by_gap] = contact.change_by(&friction, &next, self.shared());
                let by_gap = by_gap * contact.normal_force() / limit(&parts);
                change = (by_lift / balance).max(by_gap / negligible);
            }
            if change <= 1.0 || round == ROUNDS_MAX {
                let residual = change * NEGLIGIBLE_OF_TARGET * target;
                if change > 1.0 && residual > CHANGE_POOR {
                    return Err(SolveError::normal_problem(format!(
                        "pressures and tractions on the curve of the rail do not converge in {ROUNDS_MAX} iterations: forces still change by \
                             {:.1} % of the friction limit; give reference_surface \"plane\"",
                        100.0 * residual
                    )));
                }
                let remark = Remark::IterationInexact {
                    iteration: "pressures and tractions on the curve of the rail",
                    reason: "the iteration limit was reached",
                    residual,
                    tolerance: negligible,
                };
                let mut wheel = match round {
                    1 => first,
                    _ => self.wheel(&contact)?,
                };
                let mut changes = vec![[residual, 0.0]; problem.motions.len()];
                if problem.history.is_some() || !with_friction {
                    let reference = with_friction.then_some(last);
                    let neglected = self.neglected(coarse, &parts, reference, workspace)?;
                    let sums = changes.iter_mut().zip(&neglected.changes);
                    sums.for_each(|([sum, lift], change)| {
                        *sum += change[0];
                        *lift = change[1];
                    });
                    if with_friction && neglected.by_lift > balance {
                        let remark = Remark::PressuresOfLastPoint {
                            part: neglected.by_lift,
                        };
                        wheel.remarks.push(remark.into());
                    }
                }
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

    /// Estimates how the tractions of each motion would change the pressures, which belong to the tractions of the motion `reference` or to none.
    /// The effect of the gap is found from one more normal problem on the coarse grid, with the tractions that open it most.
    fn neglected(
        &self,
        coarse: CurveContact,
        parts: &[Part],
        reference: Option<usize>,
        workspace: &mut Workspace,
    ) -> Result<Neglected, SolveError> {
        let task = self.task();
        let from = match reference {
            Some(index) => self.friction(&coarse, parts, index, workspace),
            None => Friction::default(),
        };
        let contact = task.again(coarse, &from, workspace, self.watch)?;
        let limit = limit(parts);
        let mut largest = (0.0, from.clone());
        let (mut by_gap, mut by_lift) = (Vec::new(), Vec::new());
        for index in 0..self.case.problem.motions.len() {
            let friction = self.friction(&contact, parts, index, workspace);
            let [lift, gap] = contact.change_by(&from, &friction, 0.0);
            by_lift.push(lift);
            by_gap.push(gap);
            if gap > largest.0 {
                largest = (gap, friction);
            }
        }
        let (most, friction) = largest;
        let mut share = 0.0;
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
            share = change / most / limit;
        }
        // The tractions change at most in proportion to the pressures.
        let force = |index: usize| {
            let of_part = |part: &Part| {
                let sum: Resultants = part.resultants(index).iter().sum();
                sum.force_x.hypot(sum.force_y)
            };
            parts.iter().map(of_part).sum::<f64>() / limit
        };
        let changes = by_gap.iter().zip(&by_lift).enumerate();
        Ok(Neglected {
            changes: changes
                .map(|(index, (gap, lift))| [share * gap + lift * force(index), *lift])
                .collect(),
            by_lift: by_lift.into_iter().fold(0.0, f64::max),
        })
    }

    /// The wheel in equilibrium on a coarse grid with an estimate of the friction: from the table of creep forces if that is accurate enough,
    /// otherwise from coarse tractions.
    pub(super) fn coarse(
        &self,
        coupled: bool,
        workspace: &mut Workspace,
    ) -> Result<(Friction, CurveContact), SolveError> {
        let CheckedCase { problem, run, .. } = self.case;
        let task = self.task().roughly();
        let mut coarse = task.coarse(workspace, self.watch)?;
        let mut friction = Friction::default();
        if !coupled {
            return Ok((friction, coarse));
        }
        let rough = run.for_resultants(TARGET_ROUGH);
        let negligible = NEGLIGIBLE_OF_TARGET * run.resolution.target_or_usual();
        let limit = problem.friction.largest();
        let mut by_table = problem.history.is_none() && can_estimate(problem);
        let mut earlier = None;
        for _ in 0..ROUNDS_MAX {
            let of_table = by_table;
            let next = if of_table {
                let mut next = self.estimate(&coarse, workspace)?;
                let [_, opened] = coarse.change_by(&Friction::default(), &next, self.shared());
                // If the table is not accurate enough, the rounds with tractions begin with its first estimate.
                by_table = opened <= negligible / OPENED_ERROR * limit;
                // The estimate may be ten times too small.
                if 10.0 * opened <= negligible * limit {
                    next.opened = None;
                }
                next
            } else {
                let parts = self.tractions(&coarse, &rough, 0.0, workspace)?;
                self.friction(&coarse, &parts, problem.motions.len() - 1, workspace)
            };
            let [by_lift, by_gap] = coarse.change_by(&friction, &next, self.shared());
            friction = accelerated(&friction, next, &mut earlier);
            if by_table && by_lift <= CHANGE_ROUGH {
                break;
            }
            coarse = task.again(coarse, &friction, workspace, self.watch)?;
            friction.opened.clone_from(&coarse.opened);
            if !of_table && by_lift.max(by_gap / limit) <= CHANGE_ROUGH {
                break;
            }
        }
        Ok((friction, coarse))
    }

    /// Estimates the friction by the table of creep forces, with tractions proportional to the pressures.
    fn estimate(
        &self,
        contact: &CurveContact,
        workspace: &mut Workspace,
    ) -> Result<Friction, SolveError> {
        let edges = self.case.problem.friction.across().is_some();
        let patches = self.patches(contact, edges)?;
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
        let (mut traction, mut lift) = ([Vec::new(), Vec::new()], 0.0);
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
            if self.is_vertical() {
                lift +=
                    share[1] * contact.grid.area() * row.iter().sum::<f64>() * place.angle.sin();
            }
        }
        let opened = self.opened(contact, &traction, workspace);
        Ok(Friction { lift, opened })
    }

    /// The gap in mm that tractions open; `None` on planes.
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

    /// The effect of the tractions of all parts in a motion on the contact.
    fn friction(
        &self,
        contact: &CurveContact,
        parts: &[Part],
        index: usize,
        workspace: &mut Workspace,
    ) -> Friction {
        let traction = self.on_grid(contact, parts, index);
        Friction {
            lift: self.lift(contact, parts, index),
            opened: self.opened(contact, &traction, workspace),
        }
    }

    /// Vertical force on the rail in N of the tractions of all parts in a motion; 0 if the vertical force is not prescribed.
    fn lift(&self, contact: &CurveContact, parts: &[Part], index: usize) -> f64 {
        if !self.is_vertical() {
            return 0.0;
        }
        let forces = self.forces(contact, parts, index);
        forces.iter().flatten().map(|patch| patch.sheared[2]).sum()
    }

    /// Change of the tangential forces caused by a change of the pressures, relative to the normal force; 0 for equal bodies.
    fn shared(&self) -> f64 {
        let CheckedCase { problem, .. } = self.case;
        match problem.elasticity.difference == 0.0 {
            true => 0.0,
            false => problem.friction.largest(),
        }
    }
}

/// The friction to assume in the next round, by secant steps for the vertical force and for the gap. `earlier` has the friction that the last round
/// assumed and found. It is replaced by that of this round.
fn accelerated(
    counted: &Friction,
    found: Friction,
    earlier: &mut Option<[Friction; 2]>,
) -> Friction {
    let lift = |friction: &Friction| vec![friction.lift];
    let cells = found.opened.as_ref().map_or(0, Vec::len);
    let opened = |friction: &Friction| match &friction.opened {
        Some(opened) => opened.clone(),
        None => vec![0.0; cells],
    };
    let step = |of: &dyn Fn(&Friction) -> Vec<f64>| {
        let before = earlier.as_ref().map(|pair| pair.each_ref().map(of));
        next_share([counted, &found].map(of), before)
    };
    let next = Friction {
        lift: step(&lift)[0],
        opened: found.opened.as_ref().map(|_| step(&opened)),
    };
    *earlier = Some([counted.clone(), found]);
    next
}

/// Lateral and vertical resultant of the pressures in N.
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
    parts.iter().flat_map(Part::limits).sum()
}
