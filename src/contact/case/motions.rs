//! Expands the motions of a case to lists, and checks them together with its other members.

use crate::case::draft::CaseDraft;
use crate::case::solver::Limits;
use crate::case::words::contact::Contact;
use crate::case::words::friction::Friction;
use crate::case::words::motion::{AskedMotion, History, Motions, Sweep, Swept, Wheelset};
use crate::case::words::object::FAULTS_MAX;
use crate::case::words::solver::Output;
use crate::error::Fault;
use crate::normal::hertz::Patch;
use crate::rolling::history::plan::{HistoryStart, HistoryTask};
use crate::rolling::history::solve::too_long;
use crate::rolling::task::{Motion, PrescribedForces, RelativeTo};

/// The motions of a case in order, never empty.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ExpandedMotions {
    /// The motions. A creepage is 0 if its force is prescribed.
    pub(crate) motions: Vec<Motion>,
    /// The prescribed forces of each motion.
    pub(crate) forces: Vec<PrescribedForces>,
    /// The rolling speed of each motion in mm/s, if it is given.
    pub(crate) speeds: Vec<Option<f64>>,
    /// Distances and shifts, if the motions are one history.
    pub(crate) history: Option<HistoryTask>,
}

/// Returns the motions of a case.
///
/// # Errors
/// A fault at `/motion` if there are more motions than the limits allow.
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
    /// Returns the faults of prescribed forces that friction cannot carry, if the limit μN in N is known, or that a contact of profiles does
    /// not support.
    pub(crate) fn faults(
        &self,
        given: &Motions,
        limit: Option<f64>,
        of_profiles: bool,
    ) -> Vec<Fault> {
        let mut faults = Vec::new();
        for (index, forces) in self.forces.iter().enumerate() {
            let Some(name) = larger(forces) else { continue };
            let pointer = pointer(given, index, name);
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

    /// Returns the fault of the first prescribed force together with friction that falls with `what`: two creepages may give the force.
    pub(crate) fn force_fault(&self, given: &Motions, what: &str) -> Option<Fault> {
        let mut forces = self.forces.iter().enumerate();
        let (index, name) = forces.find_map(|(index, forces)| Some((index, larger(forces)?)))?;
        let pointer = pointer(given, index, name);
        let detail = format!(
            "given with friction that falls with {what}, where two creepages may give one force; sweep the creepage instead"
        );
        Some(Fault::new(pointer, detail))
    }

    /// Returns the fault of the first motion without the rolling speed that `what` needs.
    pub(crate) fn speed_fault(&self, given: &Motions, what: &str) -> Option<Fault> {
        let first = self.speeds.iter().position(Option::is_none)?;
        let pointer = pointer(given, first, "speed_mm_per_s");
        let detail = format!("missing; {what} needs the rolling speed in mm/s");
        Some(Fault::new(pointer, detail))
    }
}

/// Returns the name of the larger prescribed force, if there is any.
fn larger(forces: &PrescribedForces) -> Option<&'static str> {
    match forces {
        [None, None] => None,
        [Some(x), Some(y)] if y.abs() > x.abs() => Some("force_y_n"),
        [Some(_), _] => Some("force_x_n"),
        [None, Some(_)] => Some("force_y_n"),
    }
}

/// Returns the JSON pointer to the member `name` of motion `index`.
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

/// Returns the motions in order, never empty. In a grid the last component of `creepage_x`, `creepage_y` and `spin_per_mm` varies fastest; a
/// force takes the position of its creepage.
fn list(motions: &Motions, limits: &Limits) -> Result<Vec<AskedMotion>, Fault> {
    let count = match motions {
        // Motions of a wheelset are counted with its positions.
        Motions::One(_) | Motions::Wheelset { .. } | Motions::Wheelsets { .. } => 1,
        Motions::Many(list) => list.len() as u128,
        Motions::Sweep { sweep } => {
            let lengths = components(sweep).map(|swept| swept.map_or(1, Swept::points));
            sweep.combine.count(lengths)
        }
        Motions::History { history, .. } => history.distance_mm.points() as u128,
    };
    let most = limits.motions_max;
    if count > most as u128 {
        let detail = format!("{count} motions given; at most {most} are allowed in one case");
        return Err(Fault::new("/motion", detail));
    }
    Ok(match motions {
        Motions::One(motion) => vec![*motion],
        Motions::Many(list) => list.clone(),
        Motions::Sweep { sweep } => sweep_motions(sweep),
        Motions::History { history, .. } => history_motions(history),
        // Each patch gets its own creepages when it is found.
        Motions::Wheelset { wheelset } => vec![placeholder(wheelset)],
        Motions::Wheelsets { wheelset } => wheelset.first().map(placeholder).into_iter().collect(),
    })
}

/// Returns the motion that represents a wheelset until its patches are found.
fn placeholder(wheelset: &Wheelset) -> AskedMotion {
    AskedMotion {
        speed_mm_per_s: Some(wheelset.speed_mm_per_s),
        ..AskedMotion::default()
    }
}

/// Returns what `make` makes of the components at each point of a history: creepages, spin, forces and shifts.
fn history_points<T>(history: &History, make: impl Fn([Option<f64>; 8]) -> T) -> Vec<T> {
    let points = history.distance_mm.points();
    let values = history
        .courses()
        .map(|(_, course)| Some(course?.values(points)));
    let at = |k: usize| values.each_ref().map(|values| Some(values.as_ref()?[k]));
    (0..points).map(|k| make(at(k))).collect()
}

/// Returns the motion at each point of a history.
fn history_motions(history: &History) -> Vec<AskedMotion> {
    history_points(history, |[x, y, spin, force_x_n, force_y_n, ..]| {
        AskedMotion {
            creepage_x: x,
            creepage_y: y,
            spin_per_mm: spin.unwrap_or(0.0),
            force_x_n,
            force_y_n,
            speed_mm_per_s: history.speed_mm_per_s,
        }
    })
}

/// Returns distances and shifts of a history.
fn history_task(history: &History, start: HistoryStart) -> HistoryTask {
    HistoryTask {
        start,
        distances: history.distance_mm.values(1),
        shifts: history_points(history, |[.., x, y, turn]| Motion {
            creepage_x: x.unwrap_or(0.0),
            creepage_y: y.unwrap_or(0.0),
            spin_per_mm: turn.unwrap_or(0.0),
        }),
    }
}

/// Returns the components of a sweep. A force takes the position of its creepage.
fn components(sweep: &Sweep) -> [Option<&Swept>; 3] {
    [
        sweep.force_x_n.as_ref().or(sweep.creepage_x.as_ref()),
        sweep.force_y_n.as_ref().or(sweep.creepage_y.as_ref()),
        sweep.spin_per_mm.as_ref(),
    ]
}

fn sweep_motions(sweep: &Sweep) -> Vec<AskedMotion> {
    let values = components(sweep).map(|swept| swept.map_or_else(|| vec![0.0], Swept::values));
    let lengths = values.each_ref().map(Vec::len);
    let forced = [sweep.force_x_n.is_some(), sweep.force_y_n.is_some()];
    let motion = |k: usize| {
        let [i, j, l] = sweep.combine.indices(lengths, k);
        let [x, y, spin_per_mm] = [values[0][i], values[1][j], values[2][l]];
        AskedMotion {
            creepage_x: (!forced[0]).then_some(x),
            creepage_y: (!forced[1]).then_some(y),
            spin_per_mm,
            force_x_n: forced[0].then_some(x),
            force_y_n: forced[1].then_some(y),
            speed_mm_per_s: sweep.speed_mm_per_s,
        }
    };
    let count = sweep.combine.count(lengths) as usize;
    (0..count).map(motion).collect()
}

/// Outputs that are computed for steady rolling only.
const OUTPUTS_REFUSED: [Output; 3] = [Output::Damage, Output::Temperature, Output::Gradients];

/// Returns the fault of friction that depends on the path of a particle through the contact.
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

/// Returns the fault of a history that starts with bodies pressed together, if the patch does not stay similar to itself while it grows.
fn pressed_fault(draft: &CaseDraft) -> Option<Fault> {
    let is_similar =
        |contact: &Contact| matches!(contact, Contact::Radii { .. } | Contact::Ellipse { .. });
    if !draft.contact.as_ref().is_none_or(is_similar) {
        let detail = "\"pressed\" given for another contact than \"type\": \"radii\" or \"ellipse\", whose patches stay similar while they grow; give \"rest\"";
        return Some(Fault::new("/motion/start", detail));
    }
    let friction = draft.friction.as_ref()?;
    let (pointer, what) = if friction.across.is_some() {
        ("/friction/across", "a coefficient that varies across")
    } else if friction.along.is_some() {
        ("/friction/along", "a coefficient that varies along")
    } else if friction.law.is_some() {
        ("/friction/law", "a coefficient that falls with slip")
    } else if friction.layer.is_some() {
        ("/friction/layer", "a layer")
    } else {
        return None;
    };
    let detail = format!(
        "{what} given for bodies that are \"pressed\", whose patch stays similar while it grows with one coefficient and without a layer only"
    );
    Some(Fault::new(pointer, detail))
}

/// Returns the faults of a history together with the other members of its case; `patches` are those known before a solve.
pub(crate) fn history_faults(
    history: &HistoryTask,
    draft: &CaseDraft,
    patches: &[Patch],
    limits: &Limits,
) -> Vec<Fault> {
    let mut faults = Vec::new();
    if matches!(draft.contact, Some(Contact::Wheelset { .. })) {
        let detail = "given with a wheelset, whose pose and forces are found for steady rolling; give one of its wheels as \"type\": \"profiles\"";
        faults.push(Fault::new("/motion/history", detail));
    }
    if !draft.may_use_boundary_elements() {
        let detail = "only boundary_element (or auto) follows a history";
        faults.push(Fault::new("/solver/method", detail));
    }
    if history.start == HistoryStart::Pressed {
        faults.extend(pressed_fault(draft));
    }
    if let Some(friction) = &draft.friction {
        if friction.largest() == 0.0 {
            let detail = "no friction given; without tractions a history has no effect";
            faults.push(Fault::new("/friction", detail));
        }
        faults.extend(friction_fault(friction));
    }
    for output in OUTPUTS_REFUSED {
        if draft.outputs().contains(&output) {
            let name = output.name();
            let detail = format!("{name} given with a history; it is computed for steady rolling");
            faults.push(Fault::new("/outputs", detail));
        }
    }
    let extents: Vec<[f64; 4]> = patches.iter().map(|patch| patch.extent).collect();
    if let Some(detail) = too_long(history, &extents, limits.motions_max) {
        faults.push(Fault::new("/motion/history/distance_mm", detail));
    }
    let relative_to = draft.solver.and_then(|solver| solver.relative_to);
    if relative_to == Some(RelativeTo::Force) {
        let detail = "\"force\" given with a history, whose forces pass through 0; \"friction_limit\" is allowed";
        faults.push(Fault::new("/solver/relative_to", detail));
    }
    faults
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::words::motion::{Combine, Range, ValueList};

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
