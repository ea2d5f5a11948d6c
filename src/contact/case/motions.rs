//! Writes out the motions of a case: sweeps become lists.
//!
//! What a history goes with: contact, method, material and outputs, and how long it may be.

use crate::case::solver::Limits;
use crate::case::words::contact::Contact;
use crate::case::words::friction::Friction;
use crate::case::words::motion::{
    AskedMotion, Combine, History, HistoryCourse, Motions, Sweep, Swept, Wheelset,
};
use crate::case::words::object::FAULTS_MAX;
use crate::case::words::solver::{MethodName, Output, Solver};
use crate::error::Fault;
use crate::normal::hertz::Patch;
use crate::rolling::history::plan::{HistoryStart, HistoryTask};
use crate::rolling::history::solve::too_long;
use crate::rolling::task::{Motion, PrescribedForces};

/// The motions of a case in order, never empty.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ExpandedMotions {
    /// Creepages are 0 where a force is prescribed.
    pub(crate) motions: Vec<Motion>,
    /// What is prescribed instead, motion by motion.
    pub(crate) forces: Vec<PrescribedForces>,
    /// Rolling speeds in mm/s, where they are given.
    pub(crate) speeds: Vec<Option<f64>>,
    /// How they follow each other, where they are one history.
    pub(crate) history: Option<HistoryTask>,
}

/// The motions and prescribed forces of a case.
///
/// # Errors
/// See [`list`].
pub(crate) fn expand(motions: &Motions, limits: &Limits) -> Result<ExpandedMotions, Fault> {
    let list = list(motions, limits)?;
    let motion = |asked: &AskedMotion| Motion {
        creepage_x: asked.creepage_x.unwrap_or(0.0),
        creepage_y: asked.creepage_y.unwrap_or(0.0),
        spin_per_mm: asked.spin_per_mm,
    };
    Ok(ExpandedMotions {
        motions: list.iter().map(motion).collect(),
        forces: list.iter().map(|m| [m.force_x_n, m.force_y_n]).collect(),
        speeds: list.iter().map(|m| m.speed_mm_per_s).collect(),
        history: match motions {
            Motions::History { history, start } => Some(history_task(history, *start)),
            _ => None,
        },
    })
}

impl ExpandedMotions {
    /// Faults of prescribed forces: more than friction can carry, where the limit μN is known, or a contact without
    /// one common frame.
    pub(crate) fn faults(
        &self,
        given: &Motions,
        limit: Option<f64>,
        of_profiles: bool,
    ) -> Vec<Fault> {
        let mut faults = Vec::new();
        for (index, forces) in self.forces.iter().enumerate() {
            let Some(k) = larger(forces) else { continue };
            let pointer = pointer(given, index, ["force_x_n", "force_y_n"][k]);
            let [x, y] = forces.map(|force| force.unwrap_or(0.0));
            let length = x.hypot(y);
            let detail = if of_profiles && self.history.is_some() {
                "given with profiles in a history; creepages that all patches share are found for steady rolling only: give creepage_x and creepage_y"
                    .to_owned()
            } else if of_profiles && self.forces.len() > 1 {
                "given with profiles in several motions, which share their patches; give one motion"
                    .to_owned()
            } else if let Some(limit) =
                limit.filter(|limit| length > *limit && !(of_profiles && forces[1].is_some()))
            {
                format!(
                    "a tangential force of {length} N given; friction carries at most μN = {limit} N"
                )
            } else {
                continue;
            };
            let fault = Fault::new(pointer, detail);
            if faults.len() < FAULTS_MAX
                && !faults.iter().any(|f: &Fault| f.pointer == fault.pointer)
            {
                faults.push(fault);
            }
        }
        faults
    }
}

impl ExpandedMotions {
    /// The fault of the first prescribed force, where friction falls with slip: the force has a maximum, below which two creepages give it.
    pub(crate) fn force_fault(&self, given: &Motions, what: &str) -> Option<Fault> {
        let mut forces = self.forces.iter().enumerate();
        let (index, k) = forces.find_map(|(index, forces)| Some((index, larger(forces)?)))?;
        let pointer = pointer(given, index, ["force_x_n", "force_y_n"][k]);
        let detail = format!(
            "given with friction that falls with {what}, where two creepages may give one force; sweep the creepage instead"
        );
        Some(Fault::new(pointer, detail))
    }

    /// The fault of the first motion without a rolling speed, where one is needed for `what`.
    pub(crate) fn speed_fault(&self, given: &Motions, what: &str) -> Option<Fault> {
        let first = self.speeds.iter().position(Option::is_none)?;
        let pointer = pointer(given, first, "speed_mm_per_s");
        let detail = format!("missing; {what} needs the rolling speed in mm/s");
        Some(Fault::new(pointer, detail))
    }
}

/// The component with the larger prescribed force, if there is any.
fn larger(forces: &PrescribedForces) -> Option<usize> {
    match forces {
        [None, None] => None,
        [Some(_), None] => Some(0),
        [None, Some(_)] => Some(1),
        [Some(x), Some(y)] => Some(usize::from(y.abs() > x.abs())),
    }
}

fn pointer(given: &Motions, index: usize, name: &str) -> String {
    match given {
        Motions::Many(_) => format!("/motion/{index}/{name}"),
        Motions::Sweep { .. } => format!("/motion/sweep/{name}"),
        Motions::History { .. } => format!("/motion/history/{name}"),
        Motions::One(_) | Motions::Wheelset { .. } | Motions::Wheelsets { .. } => {
            format!("/motion/{name}")
        }
    }
}

/// The motions in order, never empty. In a grid the last named component varies fastest, in the fixed order
/// `creepage_x`, `creepage_y`, `spin_per_mm`; a force stands in the place of its creepage.
///
/// # Errors
/// A fault at `/motion` if there are more than the limits allow.
fn list(motions: &Motions, limits: &Limits) -> Result<Vec<AskedMotion>, Fault> {
    let count = match motions {
        // Those of a wheelset are counted with its positions.
        Motions::One(_) | Motions::Wheelset { .. } | Motions::Wheelsets { .. } => 1,
        Motions::Many(list) => list.len() as u128,
        Motions::Sweep { sweep } => sweep_length(sweep),
        Motions::History { history, .. } => history.distance_mm.points() as u128,
    };
    if count > limits.motions_max as u128 {
        return Err(Fault::new(
            "/motion",
            format!(
                "{count} motions given; at most {} are allowed in one case",
                limits.motions_max
            ),
        ));
    }
    Ok(match motions {
        Motions::One(motion) => vec![*motion],
        Motions::Many(list) => list.clone(),
        Motions::Sweep { sweep } => write_out(sweep),
        Motions::History { history, .. } => point_by_point(history),
        // Every patch gets its own creepages when it is found.
        Motions::Wheelset { wheelset } => vec![still_at(wheelset)],
        Motions::Wheelsets { wheelset } => wheelset.first().map(still_at).into_iter().collect(),
    })
}

/// What stands for the motion of a wheelset before patches are found.
fn still_at(wheelset: &Wheelset) -> AskedMotion {
    AskedMotion {
        speed_mm_per_s: Some(wheelset.speed_mm_per_s),
        ..AskedMotion::default()
    }
}

/// The values of a component at so many points, if it is given.
fn course(course: Option<&HistoryCourse>, points: usize) -> Option<Vec<f64>> {
    course.map(|course| course.values(points))
}

/// The motions at the points of a history.
fn point_by_point(history: &History) -> Vec<AskedMotion> {
    let points = history.distance_mm.points();
    let all = [
        &history.creepage_x,
        &history.creepage_y,
        &history.spin_per_mm,
        &history.force_x_n,
        &history.force_y_n,
    ];
    let [x, y, spin, force_x, force_y] = all.map(|given| course(given.as_ref(), points));
    let motion = |k: usize| {
        let at = |values: &Option<Vec<f64>>| values.as_ref().map(|values| values[k]);
        AskedMotion {
            creepage_x: at(&x),
            creepage_y: at(&y),
            spin_per_mm: at(&spin).unwrap_or(0.0),
            force_x_n: at(&force_x),
            force_y_n: at(&force_y),
            speed_mm_per_s: history.speed_mm_per_s,
        }
    };
    (0..points).map(motion).collect()
}

/// Distances and shifts of a history.
fn history_task(history: &History, start: HistoryStart) -> HistoryTask {
    let points = history.distance_mm.points();
    let shifts = [&history.shift_x_mm, &history.shift_y_mm, &history.turn_rad];
    let [x, y, turn] = shifts.map(|given| course(given.as_ref(), points));
    let at = |values: &Option<Vec<f64>>, k: usize| values.as_ref().map_or(0.0, |values| values[k]);
    HistoryTask {
        start,
        distances: history.distance_mm.values(points),
        shifts: (0..points)
            .map(|k| Motion {
                creepage_x: at(&x, k),
                creepage_y: at(&y, k),
                spin_per_mm: at(&turn, k),
            })
            .collect(),
    }
}

fn components(sweep: &Sweep) -> [Option<&Swept>; 3] {
    [
        sweep.force_x_n.as_ref().or(sweep.creepage_x.as_ref()),
        sweep.force_y_n.as_ref().or(sweep.creepage_y.as_ref()),
        sweep.spin_per_mm.as_ref(),
    ]
}

fn sweep_length(sweep: &Sweep) -> u128 {
    let points = components(sweep)
        .into_iter()
        .flatten()
        .map(|swept| swept.points() as u128);
    match sweep.combine {
        Combine::Together => points.max().unwrap_or(0),
        Combine::Grid => points.product(),
    }
}

fn write_out(sweep: &Sweep) -> Vec<AskedMotion> {
    let values = components(sweep).map(|swept| swept.map_or_else(|| vec![0.0], swept_values));
    let [x, y, spin] = &values;
    let forced = [sweep.force_x_n.is_some(), sweep.force_y_n.is_some()];
    let motion = |i: usize, j: usize, k: usize| AskedMotion {
        creepage_x: (!forced[0]).then_some(x[i]),
        creepage_y: (!forced[1]).then_some(y[j]),
        spin_per_mm: spin[k],
        force_x_n: forced[0].then_some(x[i]),
        force_y_n: forced[1].then_some(y[j]),
        speed_mm_per_s: sweep.speed_mm_per_s,
    };
    match sweep.combine {
        Combine::Together => (0..sweep_length(sweep) as usize)
            // One value, as of a component that is left out, serves every motion.
            .map(|n| {
                motion(
                    n.min(x.len() - 1),
                    n.min(y.len() - 1),
                    n.min(spin.len() - 1),
                )
            })
            .collect(),
        Combine::Grid => (0..x.len())
            .flat_map(|i| (0..y.len()).map(move |j| (i, j)))
            .flat_map(|(i, j)| (0..spin.len()).map(move |k| (i, j, k)))
            .map(|(i, j, k)| motion(i, j, k))
            .collect(),
    }
}

/// The values of a component in order.
pub(crate) fn swept_values(swept: &Swept) -> Vec<f64> {
    match swept {
        Swept::Constant(value) => vec![*value],
        Swept::Range(range) => range.values(),
        Swept::List(list) => list.values.clone(),
    }
}

/// Outputs that hold for steady rolling only.
const OUTPUTS_REFUSED: [(Output, &str); 3] = [
    (Output::Damage, "damage"),
    (Output::Temperature, "temperature"),
    (Output::Gradients, "gradients"),
];

/// What of a case a history has to go with, as far as it could be read.
pub(crate) struct BesideHistory<'a> {
    pub(crate) contact: Option<&'a Contact>,
    pub(crate) solver: Option<&'a Solver>,
    pub(crate) outputs: &'a [Output],
    pub(crate) friction: Option<&'a Friction>,
    /// Those that are known before a solve.
    pub(crate) patches: &'a [Patch],
}

/// The fault of friction that depends on all the slip behind a place of the contact.
fn friction_fault(friction: &Friction) -> Option<Fault> {
    let yields = friction
        .layer
        .is_some_and(|layer| layer.yield_mpa.is_some());
    let pointer = match &friction.by_temperature {
        Some(_) => "/friction/by_temperature",
        None if yields => "/friction/layer/yield_mpa",
        None => return None,
    };
    let detail = "given with a history, which follows a coefficient that does not depend on temperature and layers that do not yield";
    Some(Fault::new(pointer, detail))
}

/// The fault of a case that begins pressed together and whose patch would not stay similar to itself while it grows.
fn pressed_fault(given: &BesideHistory) -> Option<Fault> {
    let similar = given
        .contact
        .is_none_or(|c| matches!(c, Contact::Radii { .. } | Contact::Ellipse { .. }));
    if !similar {
        let detail = "\"pressed\" given for another contact than \"type\": \"radii\" or \"ellipse\", whose patches stay similar while they grow; give \"rest\"";
        return Some(Fault::new("/motion/start", detail));
    }
    let friction = given.friction?;
    let (pointer, what) = match friction {
        Friction {
            across: Some(_), ..
        } => ("/friction/across", "a coefficient that varies across"),
        Friction { along: Some(_), .. } => ("/friction/along", "a coefficient that varies along"),
        Friction { law: Some(_), .. } => ("/friction/law", "a coefficient that falls with slip"),
        Friction { layer: Some(_), .. } => ("/friction/layer", "a layer"),
        _ => return None,
    };
    let detail = format!(
        "{what} given for bodies that are \"pressed\", whose patch stays similar while it grows with one coefficient and without a layer only"
    );
    Some(Fault::new(pointer, detail))
}

/// Faults of a case with a history.
pub(crate) fn faults(history: &HistoryTask, given: &BesideHistory, limits: &Limits) -> Vec<Fault> {
    let mut faults = Vec::new();
    if matches!(given.contact, Some(Contact::Wheelset { .. })) {
        let detail = "given with a wheelset, whose pose and forces are found for steady rolling; give one of its wheels as \"type\": \"profiles\"";
        faults.push(Fault::new("/motion/history", detail));
    }
    let method = given.solver.map(|solver| solver.method);
    if method.is_some_and(|m| !matches!(m, MethodName::Auto | MethodName::BoundaryElement)) {
        let detail = "only boundary_element (or auto) follows a history";
        faults.push(Fault::new("/solver/method", detail));
    }
    if history.start == HistoryStart::Pressed {
        faults.extend(pressed_fault(given));
    }
    if given
        .friction
        .is_some_and(|friction| friction.largest() == 0.0)
    {
        let detail = "no friction given; without tractions a history has no effect";
        faults.push(Fault::new("/friction", detail));
    }
    faults.extend(given.friction.and_then(friction_fault));
    for (output, name) in OUTPUTS_REFUSED {
        if given.outputs.contains(&output) {
            let detail = format!("{name} given with a history; it is computed for steady rolling");
            faults.push(Fault::new("/outputs", detail));
        }
    }
    let extents: Vec<[f64; 4]> = given.patches.iter().map(|patch| patch.extent).collect();
    if let Some(detail) = too_long(history, &extents, limits.motions_max) {
        faults.push(Fault::new("/motion/history/distance_mm", detail));
    }
    faults
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::words::motion::Range;
    use crate::case::words::motion::ValueList;

    fn range(from: f64, to: f64, points: u32) -> Option<Swept> {
        Some(Swept::Range(Range { from, to, points }))
    }

    fn triple(motion: &Motion) -> [f64; 3] {
        [motion.creepage_x, motion.creepage_y, motion.spin_per_mm]
    }

    #[test]
    fn a_sweep_together_runs_side_by_side() {
        let sweep = Sweep {
            creepage_x: range(0.0, 0.004, 5),
            creepage_y: None,
            spin_per_mm: range(1.0, -1.0, 5),
            force_x_n: None,
            force_y_n: None,
            speed_mm_per_s: None,
            combine: Combine::Together,
        };
        let list = expand(&Motions::Sweep { sweep }, &Limits::default())
            .unwrap()
            .motions;
        assert_eq!(list.len(), 5);
        assert_eq!(triple(&list[0]), [0.0, 0.0, 1.0]);
        assert_eq!(triple(&list[2]), [0.002, 0.0, 0.0]);
        assert_eq!(triple(&list[4]), [0.004, 0.0, -1.0]);
    }

    #[test]
    fn a_number_serves_every_motion_and_listed_values_keep_their_order() {
        let sweep = Sweep {
            creepage_x: Some(Swept::List(ValueList {
                values: vec![3.0, 1.0, 2.0],
            })),
            creepage_y: Some(Swept::Constant(7.0)),
            spin_per_mm: range(4.0, 4.0, 1),
            force_x_n: None,
            force_y_n: None,
            speed_mm_per_s: None,
            combine: Combine::Together,
        };
        let list = expand(&Motions::Sweep { sweep }, &Limits::default())
            .unwrap()
            .motions;
        let triples: Vec<_> = list.iter().map(triple).collect();
        assert_eq!(triples, [[3.0, 7.0, 4.0], [1.0, 7.0, 4.0], [2.0, 7.0, 4.0]]);
    }

    #[test]
    fn in_a_grid_the_last_named_component_is_fastest() {
        let sweep = Sweep {
            creepage_x: range(1.0, 2.0, 2),
            creepage_y: range(5.0, 5.0, 1),
            spin_per_mm: range(7.0, 9.0, 3),
            force_x_n: None,
            force_y_n: None,
            speed_mm_per_s: None,
            combine: Combine::Grid,
        };
        let list = expand(&Motions::Sweep { sweep }, &Limits::default())
            .unwrap()
            .motions;
        let expected = [
            [1.0, 7.0],
            [1.0, 8.0],
            [1.0, 9.0],
            [2.0, 7.0],
            [2.0, 8.0],
            [2.0, 9.0],
        ];
        assert_eq!(list.len(), expected.len());
        for (motion, [x, spin]) in list.iter().zip(expected) {
            assert_eq!(triple(motion), [x, 5.0, spin]);
        }
    }

    #[test]
    fn the_limit_of_motions_is_kept_on_both_sides() {
        let limits = Limits {
            motions_max: 100,
            ..Limits::default()
        };
        let grid = |n, m| Motions::Sweep {
            sweep: Sweep {
                creepage_x: range(0.0, 1.0, n),
                creepage_y: range(0.0, 1.0, m),
                spin_per_mm: None,
                force_x_n: None,
                force_y_n: None,
                speed_mm_per_s: None,
                combine: Combine::Grid,
            },
        };
        assert_eq!(expand(&grid(10, 10), &limits).unwrap().motions.len(), 100);
        let fault = expand(&grid(1_000_000, 1_000_000), &limits).unwrap_err();
        assert_eq!(fault.pointer, "/motion");
        assert!(
            fault.detail.starts_with("1000000000000 motions"),
            "{}",
            fault.detail
        );
        assert!(expand(&grid(101, 1), &limits).is_err());
    }

    #[test]
    fn a_swept_force_stands_in_the_place_of_its_creepage() {
        let sweep = Sweep {
            creepage_x: None,
            creepage_y: range(1.0, 2.0, 2),
            spin_per_mm: None,
            force_x_n: range(-50.0, 50.0, 3),
            force_y_n: None,
            speed_mm_per_s: None,
            combine: Combine::Grid,
        };
        let found = expand(&Motions::Sweep { sweep }, &Limits::default()).unwrap();
        let forces: Vec<PrescribedForces> = found.forces.clone();
        assert_eq!(forces.len(), 6);
        assert_eq!(forces[0], [Some(-50.0), None]);
        assert_eq!(forces[5], [Some(50.0), None]);
        assert_eq!(triple(&found.motions[1]), [0.0, 2.0, 0.0]);
    }
}
