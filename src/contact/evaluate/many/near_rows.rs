//! Groups of rows that are solved as motions of one case, each started from the one before.

use std::collections::VecDeque;

use crate::contact::evaluate::many::likeness::Likeness;
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::problem::physics::RowMotion;

/// Groups that are open at a time, so that memory does not grow with the rows. Chosen by judgement; how much it matters was not measured.
const GROUPS_MAX: usize = 64;
/// Motions of a case that is solved as one: the first of them is not started from another, and a case without an answer is solved again row by
/// row. Chosen by judgement; how much it matters was not measured.
const MOTIONS_MAX: usize = 128;
/// Rows that are put in order together: the time for that grows with their square. Chosen by judgement; how much it matters was not measured.
const CHAINED_MAX: usize = 4096;
/// Steps that differ by no more than this are equally long. Numeric safety: those of a grid differ by rounding.
const SAME_STEP: f64 = 1e-6;

/// Rows that are like the first of them.
#[derive(Debug)]
pub(crate) struct Group {
    /// The case of the first row.
    pub(crate) head: CheckedCase,
    /// Its rows, in the order in which they came.
    pub(crate) members: Vec<Member>,
}

/// A row of a group.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Member {
    /// Number of the row.
    pub(crate) row: usize,
    /// Its motion as the head would make it.
    pub(crate) motion: RowMotion,
    /// How it is like the head.
    pub(crate) likeness: Likeness,
}

/// Groups to which rows are still added.
#[derive(Debug, Default)]
pub(crate) struct OpenGroups {
    groups: VecDeque<Group>,
}

impl OpenGroups {
    /// Adds a row to the group of its like; gives back a group to make room, if it takes that.
    pub(crate) fn add(
        &mut self,
        row: usize,
        checked: CheckedCase,
        motion: RowMotion,
    ) -> Option<Group> {
        for group in self.groups.iter_mut().rev() {
            if let Some(likeness) = Likeness::of(&checked, &group.head) {
                group.members.push(Member {
                    row,
                    motion: likeness.motion(motion),
                    likeness,
                });
                return None;
            }
        }
        let first = Member {
            row,
            motion,
            likeness: Likeness::Same,
        };
        self.groups.push_back(Group {
            head: checked,
            members: vec![first],
        });
        let full = self.groups.len() > GROUPS_MAX;
        full.then(|| self.groups.pop_front()).flatten()
    }

    /// The groups that are left.
    pub(crate) fn close(self) -> impl Iterator<Item = Group> {
        self.groups.into_iter()
    }
}

/// The largest case that rows like this one are solved in.
pub(crate) fn largest(checked: &CheckedCase) -> Option<CheckedCase> {
    let motion = checked.problem.row_motion()?;
    let motions = std::iter::repeat_n(motion, MOTIONS_MAX);
    Some(CheckedCase {
        problem: checked.problem.of_rows(motions),
        ..checked.clone()
    })
}

impl Group {
    /// The rows of the group in an order in which near motions follow each other, in parts that are solved as one case each.
    pub(crate) fn parts(&self) -> Vec<(CheckedCase, Vec<Member>)> {
        let chained = self.members.chunks(CHAINED_MAX).map(chained);
        let mut parts = Vec::new();
        for members in chained {
            for part in members.chunks(MOTIONS_MAX) {
                let motions = part.iter().map(|member| member.motion);
                let case = CheckedCase {
                    problem: self.head.problem.of_rows(motions),
                    ..self.head.clone()
                };
                parts.push((case, part.to_vec()));
            }
        }
        parts
    }
}

/// Rows in an order in which near motions follow each other: from the first on always the nearest that is left. Of several that are equally
/// near, the one straight on, else the one that came first; so a grid is walked line by line, on which starts are extrapolated.
fn chained(members: &[Member]) -> Vec<Member> {
    let places = places(members);
    let mut left: Vec<usize> = (1..members.len()).collect();
    let mut order = vec![0];
    let mut straight: Option<ChainPlace> = None;
    while !left.is_empty() {
        let last = places[order[order.len() - 1]];
        let nearest = left
            .iter()
            .map(|k| distance(&places[*k], &last))
            .fold(f64::INFINITY, f64::min);
        let mut chosen = None;
        for (at, k) in left.iter().enumerate() {
            if distance(&places[*k], &last) > (1.0 + SAME_STEP) * nearest {
                continue;
            }
            let on = straight.map(|straight| distance(&places[*k], &straight));
            if on.is_some_and(|off| off <= SAME_STEP * nearest) {
                chosen = Some(at);
                break;
            }
            chosen = chosen.or(Some(at));
        }
        let next = left.remove(chosen.unwrap_or_default());
        straight = Some(std::array::from_fn(|k| 2.0 * places[next][k] - last[k]));
        order.push(next);
    }
    order.into_iter().map(|k| members[k]).collect()
}

/// Creepages, spin and prescribed forces of a row, each in parts of its range over the rows.
type ChainPlace = [f64; 5];

fn places(members: &[Member]) -> Vec<ChainPlace> {
    let mut places: Vec<ChainPlace> = members
        .iter()
        .map(|Member { motion, .. }| {
            let [force_x, force_y] = motion.forces.map(Option::unwrap_or_default);
            let motion = motion.motion;
            let spin = motion.spin_per_mm;
            [motion.creepage_x, motion.creepage_y, spin, force_x, force_y]
        })
        .collect();
    for k in 0..5 {
        let values = || places.iter().map(|place| place[k]);
        let largest = values().fold(f64::NEG_INFINITY, f64::max);
        let range = largest - values().fold(f64::INFINITY, f64::min);
        if range > 0.0 {
            places.iter_mut().for_each(|place| place[k] /= range);
        }
    }
    places
}

/// The square of the distance.
fn distance(a: &ChainPlace, b: &ChainPlace) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}
