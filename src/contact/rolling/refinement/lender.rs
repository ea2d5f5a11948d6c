//! What a motion of a sweep lends to its neighbours: how much its resultants change with the second rule and on both companion meshes.
//! Between nearby motions on the same mesh these changes are almost linear; three motions for which they were computed show how far they
//! are from it.

use crate::contact::method::Method;
use crate::contact::rolling::answer::LevelAnswer;
use crate::contact::rolling::refinement::companion_answer::CompanionAnswer;
use crate::contact::rolling::refinement::constants::DIFFERENCES;
use crate::contact::rolling::refinement::distances::distances;
use crate::contact::rolling::refinement::error_estimate::{Indicators, Measured};
use crate::contact::rolling::refinement::level_solve::JudgedAnswer;
use crate::contact::rolling::refinement::refine::extrapolate;
use crate::contact::rolling::refinement::state::RefinementState;
use crate::contact::rolling::resolution::Resolution;
use crate::contact::rolling::resultants::Resultants;
use crate::contact::rolling::strip_mesh::StripMesh;
use crate::contact::rolling::task::RollingTask;

/// A motion borrows if interpolation between its neighbours is off by no more than this share of the larger of their estimates, or by the share of the
/// target below; this error is added to its own estimate. With 0.5 and 0.1, as many motions borrow and as many estimates hold
/// (`cargo bench --bench calibrate -- sweeps`). With 1 and 0.5 a creep curve of 51 points takes 14 % more products, because larger estimates miss
/// the target.
const SHARE_BENT: f64 = 0.3;
/// See [`SHARE_BENT`].
const SHARE_BENT_TARGET: f64 = 0.2;

/// Largest number of motions from one comparison to the next. Chosen by judgement; how much it matters was not measured.
const STRIDE_MAX: usize = 16;

/// Changes of the resultants of every patch: to the three-point rule, to half the strips, to half the cells.
type Changes = [Vec<Resultants>; 3];

/// May motion `index` borrow? Not if the bounds depend on the slips of the three-point rule, and not if forces are prescribed, because the search
/// for their creepages needs a judged answer at every trial.
#[must_use]
pub fn may_borrow(task: &RollingTask, index: usize) -> bool {
    let constant = !task.friction.depends_on_slip()
        && task.passage(index).is_none()
        && !task.friction.is_frictionless();
    task.method == Method::BoundaryElement
        && matches!(task.resolution, Resolution::Target(_))
        && !task.single_motion
        && task.forces[index] == [None; 2]
        && !task.is_coupled()
        && constant
}

/// A motion that was compared with both companions.
#[derive(Debug, Clone)]
pub struct Lender {
    /// Where it lies on the line of its sweep.
    pub place: f64,
    changes: Changes,
    /// See [`CompanionAnswer::Found`].
    reaches: [f64; 2],
    measured: Measured,
    /// Its estimates.
    errors: Vec<f64>,
}

impl Lender {
    /// A motion at a place of its sweep; nothing if one of its rules or companions has no answer.
    #[must_use]
    pub fn new(
        place: f64,
        level: &StripMesh,
        solved: &JudgedAnswer,
        companions: &[CompanionAnswer; 2],
    ) -> Option<Lender> {
        let point = &solved.point;
        let Indicators::Measured(measured) = &solved.indicators else {
            return None;
        };
        let [
            CompanionAnswer::Found(across, strips),
            CompanionAnswer::Found(along, cells),
        ] = companions
        else {
            return None;
        };
        let second = point.tangential.second.as_ref()?;
        let second: Vec<Resultants> = (0..point.summed.len())
            .map(|p| Resultants::of_patch(level, second, p))
            .collect();
        let changes = [&second, across, along].map(|other| {
            let pairs = other.iter().zip(&point.summed);
            pairs
                .map(|(other, here)| other.plus(here.times(-1.0)))
                .collect()
        });
        Some(Lender {
            place,
            changes,
            reaches: [*strips, *cells],
            measured: measured.as_ref().clone(),
            errors: point.errors.iter().copied().collect::<Option<_>>()?,
        })
    }
}

/// Sums of changes times factors.
fn combined<const N: usize>(parts: [(&Changes, f64); N]) -> Changes {
    [0, 1, 2].map(|kind| {
        let patches = parts[0].0[kind].len();
        let of = |p: usize| {
            let zero = Resultants::default();
            let terms = parts
                .iter()
                .map(|(changes, by)| changes[kind][p].times(*by));
            terms.fold(zero, Resultants::plus)
        };
        (0..patches).map(of).collect()
    })
}

/// The largest error of linear interpolation between two places `reach` apart, if the changes curve as they do over these three motions, in
/// order. It is weighted as in an estimate, for every patch and then for the sum.
#[must_use]
pub fn bent(task: &RollingTask, three: [&Lender; 3], reach: f64) -> Vec<f64> {
    let [a, b, c] = three;
    let (before, after) = (b.place - a.place, c.place - b.place);
    // The second divided difference, times the largest product of the distances to both ends.
    let by = 0.25 * reach * reach / (after + before);
    let off = combined([
        (&a.changes, by / before),
        (&b.changes, -by / before - by / after),
        (&c.changes, by / after),
    ]);
    let patches = task.footprint.patches();
    let none = vec![Resultants::default(); patches.len()];
    let kinds = [0, 1, 2].map(|kind| distances(task, patches, &none, &off[kind]));
    let weights = [1.0, b.reaches[0], b.reaches[1]];
    let of = |k: usize| {
        let squares = kinds.iter().zip(weights);
        let squares: f64 = squares
            .map(|(kind, weight)| (weight * kind[k]).powi(2))
            .sum();
        DIFFERENCES * b.measured.scale * squares.sqrt()
    };
    (0..=patches.len()).map(of).collect()
}

/// Is an error found by [`bent`] small enough beside the estimates of both motions, or beside the target?
#[must_use]
pub fn is_straight(off: &[f64], ends: [&Lender; 2], target: f64) -> bool {
    let [a, b] = ends;
    let estimates = a.errors.iter().zip(&b.errors);
    let mut pairs = off.iter().zip(estimates);
    pairs.all(|(off, (a, b))| *off <= (SHARE_BENT * a.max(*b)).max(SHARE_BENT_TARGET * target))
}

/// Sets the indicators of a motion at `place` from the two compared motions around it: the interpolated changes, each at least as large as at
/// either end, and the interpolation error `off`. Returns the answers on the companions as if they had been solved.
fn lend(
    task: &RollingTask,
    solved: &mut JudgedAnswer,
    place: f64,
    ends: [&Lender; 2],
    off: &[f64],
) -> [CompanionAnswer; 2] {
    let untried = [CompanionAnswer::Untried, CompanionAnswer::Untried];
    let Indicators::Measured(own) = &mut solved.indicators else {
        return untried;
    };
    let [a, b] = ends;
    let weight = (place - a.place) / (b.place - a.place);
    let changes = combined([(&a.changes, 1.0 - weight), (&b.changes, weight)]);
    let summed = &solved.point.summed;
    let [second, across, along] = changes.map(|changes| {
        let pairs = changes.iter().zip(summed);
        pairs
            .map(|(change, here)| here.plus(*change))
            .collect::<Vec<_>>()
    });
    let larger = |values: Vec<f64>, ends: [Option<&Vec<f64>>; 2]| -> Vec<f64> {
        let end = |k: usize| ends.iter().flatten().map(move |end| end[k]);
        let values = values.iter().enumerate();
        values
            .map(|(k, value)| end(k).fold(*value, f64::max))
            .collect()
    };
    let patches = task.footprint.patches();
    let rules = distances(task, patches, summed, &second);
    let [here, there] = [&a.measured, &b.measured];
    own.rules = Some(larger(rules, [here.rules.as_ref(), there.rules.as_ref()]));
    let found = [(across, 0), (along, 1)].map(|(other, k)| {
        let mut apart = distances(task, patches, summed, &other);
        apart.iter_mut().for_each(|d| *d *= a.reaches[k]);
        let ends = [here, there].map(|end| end.companions[k].as_ref());
        own.companions[k] = Some(larger(apart, ends));
        CompanionAnswer::Found(other, a.reaches[k])
    });
    own.lent = off.to_vec();
    solved.point.errors = solved.indicators.errors();
    found
}

/// Lets a motion borrow from the two lenders around its place, of which the first has the number `begin`. Returns `false` if interpolation
/// between them is not exact enough.
pub fn borrow(
    task: &RollingTask,
    state: &RefinementState,
    target: f64,
    solved: &mut JudgedAnswer,
    place: f64,
    lenders: &[Lender],
    begin: usize,
) -> bool {
    let ends = [&lenders[begin], &lenders[begin + 1]];
    let reach = ends[1].place - ends[0].place;
    // The third lender may be the one before or the one behind; the larger curvature counts.
    let first = [begin.checked_sub(1), Some(begin)];
    let three = first
        .into_iter()
        .flatten()
        .filter_map(|first| lenders.get(first..first + 3));
    let off = three.map(|three| bent(task, [&three[0], &three[1], &three[2]], reach));
    let off = off.reduce(|a, b| a.iter().zip(&b).map(|(a, b)| a.max(*b)).collect());
    let Some(off) = off else {
        return false;
    };
    if !is_straight(&off, ends, target) {
        return false;
    }
    let companions = lend(task, solved, place, ends, &off);
    extrapolate(task, state, solved, &companions);
    true
}

/// The three-point tractions of an answer less those of the trapezoid rule; nothing per cell if it has but one rule.
#[must_use]
pub fn apart(answer: &LevelAnswer) -> [Vec<f64>; 2] {
    let Some(second) = &answer.second else {
        return [0, 1].map(|k| vec![0.0; answer.traction[k].len()]);
    };
    [0, 1].map(|k| {
        let pairs = second[k].iter().zip(&answer.traction[k]);
        pairs.map(|(second, first)| second - first).collect()
    })
}

/// How many motions to go on to the next that is compared, `stride` after the last one, where they are `each` apart.
pub(super) fn next_stride(
    task: &RollingTask,
    lenders: &[Lender],
    stride: usize,
    each: f64,
    target: f64,
) -> usize {
    let [a, b, c] = lenders else {
        return 1;
    };
    let each = if each > 0.0 { each } else { c.place - b.place };
    let mut stride = (2 * stride).min(STRIDE_MAX);
    while stride > 1 {
        let off = bent(task, [a, b, c], each * stride as f64);
        if is_straight(&off, [b, c], target) {
            break;
        }
        stride /= 2;
    }
    stride
}
