//! Condenses a traffic to a few representative states.
//!
//! Rows are parted into groups, each represented by the mean of its rows. The error is measured: every group is parted once more along each column
//! in which its rows differ, the halves are solved, and the sum of all changes of the wear is the error of the groups. Until it meets the tolerance,
//! the groups that change most are replaced by the halves that change most.

use crate::contact::error::SolveError;
use crate::contact::evolution::pass::{BodyWear, Pass};
use crate::contact::evolution::task::Evolution;
use crate::contact::solution::words::evolution::{CondensedTraffic, TrafficState};

/// Groups to begin with.
const GROUPS_FIRST: usize = 4;
/// In each round the groups that change most are parted, this share of all.
const PARTED: f64 = 0.25;

/// A column in which the rows of a group differ by less than this part of the variance of the widest one is not parted.
const VARIANCE_SMALL: f64 = 0.01;

/// Rows with the wear of their mean.
#[derive(Debug, Clone)]
struct Group {
    rows: Vec<usize>,
    share: f64,
    values: Vec<f64>,
    pass: Pass,
}

/// Effect of dividing a group.
#[derive(Debug, Clone)]
struct Parted {
    /// The wear of both bodies, summed over the columns.
    change: [BodyWear; 2],
    /// The halves that change most; nothing where the rows are alike.
    halves: Option<[Group; 2]>,
}

/// A traffic of a few states.
///
/// # Errors
/// Those of `solve`.
pub(crate) fn condensed(
    task: &Evolution,
    solve: &mut dyn FnMut(&[f64]) -> Result<Pass, SolveError>,
) -> Result<CondensedTraffic, SolveError> {
    let scales = scales(task);
    let rows: Vec<usize> = (0..task.shares.len())
        .filter(|row| task.shares[*row] > 0.0)
        .collect();
    let mut parts = vec![rows];
    while parts.len() < GROUPS_FIRST {
        let spread = |rows: &Vec<usize>| {
            spreads(task, &scales, rows)
                .first()
                .map_or(0.0, |(_, spread)| *spread)
        };
        let next =
            (0..parts.len()).max_by(|a, b| spread(&parts[*a]).total_cmp(&spread(&parts[*b])));
        let Some(next) = next else { break };
        let column = spreads(task, &scales, &parts[next]).first().copied();
        let Some([low, high]) = column.and_then(|(k, _)| halves(task, k, &parts[next])) else {
            break;
        };
        parts.splice(next..=next, [low, high]);
    }
    let most = task.plan.accuracy.states_max as usize;
    let mut groups = Vec::with_capacity(most);
    for rows in parts {
        groups.push(group(task, rows, solve)?);
    }
    let mut parted: Vec<Option<Parted>> = vec![None; groups.len()];
    loop {
        let total = [0, 1].map(|body| {
            let mut all = BodyWear::none(groups[0].pass.wear[body].area.len());
            groups
                .iter()
                .for_each(|group| all.add(group.share, &group.pass.wear[body]));
            size(&all).max(f64::MIN_POSITIVE)
        });
        let wearing = task.plan.wearing.flags();
        let part = |wear: &[BodyWear; 2]| -> f64 {
            let bodies = (0..2).filter(|body| wearing[*body]);
            bodies.map(|body| size(&wear[body]) / total[body]).sum()
        };
        for (group, parted) in groups.iter().zip(&mut parted) {
            if parted.is_none() {
                *parted = Some(parting(task, &scales, group, &part, solve)?);
            }
        }
        let changes: Vec<&[BodyWear; 2]> = parted
            .iter()
            .flatten()
            .map(|parted| &parted.change)
            .collect();
        let error = [0, 1].map(|body| {
            let mut all = BodyWear::none(changes[0][body].area.len());
            changes
                .iter()
                .for_each(|change| all.add(1.0, &change[body]));
            size(&all) / total[body]
        });
        let error = [0, 1].map(|body| if wearing[body] { error[body] } else { 0.0 });
        if error[0].max(error[1]) <= task.plan.accuracy.states_tolerance || groups.len() >= most {
            return Ok(CondensedTraffic {
                rows: task.shares.len() as u32,
                pointers: task.pointers.clone(),
                states: groups
                    .into_iter()
                    .map(|group| TrafficState {
                        share: group.share,
                        rows: group.rows.len() as u32,
                        values: group.values,
                    })
                    .collect(),
                error,
            });
        }
        let weights: Vec<f64> = changes.iter().map(|change| part(change)).collect();
        let divisible = |k: &usize| {
            parted[*k]
                .as_ref()
                .is_some_and(|group| group.halves.is_some())
        };
        let mut order: Vec<usize> = (0..groups.len()).filter(divisible).collect();
        order.sort_by(|a, b| weights[*b].total_cmp(&weights[*a]).then(a.cmp(b)));
        let count = (PARTED * groups.len() as f64).ceil() as usize;
        order.truncate(count.min(most - groups.len()));
        order.sort_unstable();
        for k in order.into_iter().rev() {
            if let Some([low, high]) = parted[k].take().and_then(|parted| parted.halves) {
                groups.splice(k..=k, [low, high]);
                parted.splice(k..=k, [None, None]);
            }
        }
    }
}

/// Sum of the sizes of the areas.
fn size(wear: &BodyWear) -> f64 {
    wear.area.iter().map(|area| area.abs()).sum()
}

/// Parts a group along each column in which its rows differ; `part` is the size of wear relative to that of the traffic.
fn parting(
    task: &Evolution,
    scales: &[f64],
    group: &Group,
    part: &dyn Fn(&[BodyWear; 2]) -> f64,
    solve: &mut dyn FnMut(&[f64]) -> Result<Pass, SolveError>,
) -> Result<Parted, SolveError> {
    let points = [0, 1].map(|body| group.pass.wear[body].area.len());
    let mut change = points.map(BodyWear::none);
    let mut best: Option<(f64, [Group; 2])> = None;
    for (column, _) in spreads(task, scales, &group.rows) {
        let Some([low, high]) = halves(task, column, &group.rows) else {
            continue;
        };
        let halves = [
            self::group(task, low, solve)?,
            self::group(task, high, solve)?,
        ];
        let mut own = points.map(BodyWear::none);
        for body in 0..2 {
            own[body].add(-group.share, &group.pass.wear[body]);
            for half in &halves {
                own[body].add(half.share, &half.pass.wear[body]);
            }
            change[body].add(1.0, &own[body]);
        }
        let own = part(&own);
        if best.as_ref().is_none_or(|(most, _)| own > *most) {
            best = Some((own, halves));
        }
    }
    Ok(Parted {
        change,
        halves: best.map(|(_, halves)| halves),
    })
}

fn group(
    task: &Evolution,
    rows: Vec<usize>,
    solve: &mut dyn FnMut(&[f64]) -> Result<Pass, SolveError>,
) -> Result<Group, SolveError> {
    let share: f64 = rows.iter().map(|row| task.shares[*row]).sum();
    let values: Vec<f64> = task
        .columns
        .iter()
        .map(|column| mean(task, &rows, column))
        .collect();
    Ok(Group {
        share,
        pass: solve(&values)?,
        values,
        rows,
    })
}

/// Mean of a column over rows.
fn mean(task: &Evolution, rows: &[usize], column: &[f64]) -> f64 {
    let first = column[rows[0]];
    // About the first value, so that equal values have it as their mean to the last bit.
    let parts = rows.iter().map(|row| {
        [
            task.shares[*row],
            task.shares[*row] * (column[*row] - first),
        ]
    });
    let [share, sum] = parts.fold([0.0; 2], |all, part| [all[0] + part[0], all[1] + part[1]]);
    first + sum / share
}

/// Standard deviation of each column.
fn scales(task: &Evolution) -> Vec<f64> {
    let rows: Vec<usize> = (0..task.shares.len()).collect();
    task.columns
        .iter()
        .map(|column| variance(task, &rows, column).sqrt())
        .collect()
}

/// Sum over rows of share times squared distance from the mean.
fn variance(task: &Evolution, rows: &[usize], column: &[f64]) -> f64 {
    let mean = mean(task, rows, column);
    rows.iter()
        .map(|row| task.shares[*row] * (column[*row] - mean).powi(2))
        .sum()
}

/// The columns in which rows differ, the widest first, each with the variance of the rows relative to that of the traffic.
fn spreads(task: &Evolution, scales: &[f64], rows: &[usize]) -> Vec<(usize, f64)> {
    let columns = task.columns.iter().zip(scales).enumerate();
    let columns = columns.filter(|(_, (_, scale))| **scale > 0.0);
    let mut spreads: Vec<(usize, f64)> = columns
        .map(|(k, (column, scale))| (k, variance(task, rows, column) / scale.powi(2)))
        .collect();
    spreads.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let least = spreads
        .first()
        .map_or(0.0, |(_, most)| VARIANCE_SMALL * most);
    spreads.retain(|(_, spread)| *spread > least);
    spreads
}

/// Rows below and above the mean of a column; nothing where they are alike.
fn halves(task: &Evolution, column: usize, rows: &[usize]) -> Option<[Vec<usize>; 2]> {
    let column = &task.columns[column];
    let mean = mean(task, rows, column);
    let (low, high): (Vec<usize>, Vec<usize>) = rows.iter().partition(|row| column[**row] < mean);
    (!low.is_empty() && !high.is_empty()).then_some([low, high])
}
