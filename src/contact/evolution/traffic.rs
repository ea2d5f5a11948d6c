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

/// Solves the states of these values, one pass for each.
pub(crate) type SolveStates<'a> = dyn FnMut(&[&[f64]]) -> Result<Vec<Pass>, SolveError> + 'a;

/// A traffic of a few states.
///
/// # Errors
/// Those of `solve`.
pub(crate) fn condensed(
    task: &Evolution,
    solve: &mut SolveStates,
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
    let mut groups = groups_of(task, parts, solve)?;
    let mut known: Vec<Option<Parted>> = vec![None; groups.len()];
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
        let new: Vec<usize> = (0..groups.len()).filter(|k| known[*k].is_none()).collect();
        let parents: Vec<&Group> = new.iter().map(|k| &groups[*k]).collect();
        let found = parted(task, &scales, &parents, &part, solve)?;
        for (k, parted) in new.into_iter().zip(found) {
            known[k] = Some(parted);
        }
        let changes: Vec<&[BodyWear; 2]> = known
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
            let states = groups.into_iter().map(|group| TrafficState {
                share: group.share,
                rows: group.rows.len() as u32,
                values: group.values,
            });
            return Ok(CondensedTraffic {
                rows: task.shares.len() as u32,
                pointers: task.pointers.clone(),
                states: states.collect(),
                error,
            });
        }
        let weights: Vec<f64> = changes.iter().map(|change| part(change)).collect();
        let divisible = |k: &usize| {
            known[*k]
                .as_ref()
                .is_some_and(|group| group.halves.is_some())
        };
        let mut order: Vec<usize> = (0..groups.len()).filter(divisible).collect();
        order.sort_by(|a, b| weights[*b].total_cmp(&weights[*a]).then(a.cmp(b)));
        let count = (PARTED * groups.len() as f64).ceil() as usize;
        order.truncate(count.min(most - groups.len()));
        order.sort_unstable();
        for k in order.into_iter().rev() {
            if let Some([low, high]) = known[k].take().and_then(|parted| parted.halves) {
                groups.splice(k..=k, [low, high]);
                known.splice(k..=k, [None, None]);
            }
        }
    }
}

/// Sum of the sizes of the areas.
fn size(wear: &BodyWear) -> f64 {
    wear.area.iter().map(|area| area.abs()).sum()
}

/// Parts groups along each column in which their rows differ; `part` is the size of wear relative to that of the traffic.
fn parted(
    task: &Evolution,
    scales: &[f64],
    parents: &[&Group],
    part: &dyn Fn(&[BodyWear; 2]) -> f64,
    solve: &mut SolveStates,
) -> Result<Vec<Parted>, SolveError> {
    // Two halves of the rows of `parents[owner]` each.
    let (mut owners, mut rows) = (Vec::new(), Vec::new());
    for (k, group) in parents.iter().enumerate() {
        for (column, _) in spreads(task, scales, &group.rows) {
            if let Some(halves) = halves(task, column, &group.rows) {
                owners.push(k);
                rows.extend(halves);
            }
        }
    }
    let mut solved = groups_of(task, rows, solve)?.into_iter();
    let unchanged = |group: &&Group| Parted {
        change: [0, 1].map(|body| BodyWear::none(group.pass.wear[body].area.len())),
        halves: None,
    };
    let mut all: Vec<Parted> = parents.iter().map(unchanged).collect();
    let mut largest = vec![f64::NEG_INFINITY; parents.len()];
    for k in owners {
        let (Some(low), Some(high)) = (solved.next(), solved.next()) else {
            break;
        };
        let group = parents[k];
        let own = [0, 1].map(|body| {
            let mut own = BodyWear::none(group.pass.wear[body].area.len());
            own.add(-group.share, &group.pass.wear[body]);
            own.add(low.share, &low.pass.wear[body]);
            own.add(high.share, &high.pass.wear[body]);
            all[k].change[body].add(1.0, &own);
            own
        });
        let own = part(&own);
        if own > largest[k] {
            largest[k] = own;
            all[k].halves = Some([low, high]);
        }
    }
    Ok(all)
}

fn groups_of(
    task: &Evolution,
    parts: Vec<Vec<usize>>,
    solve: &mut SolveStates,
) -> Result<Vec<Group>, SolveError> {
    let mean_of = |rows: &Vec<usize>| -> Vec<f64> {
        let columns = task.columns.iter();
        columns.map(|column| mean(task, rows, column)).collect()
    };
    let means: Vec<Vec<f64>> = parts.iter().map(mean_of).collect();
    let states: Vec<&[f64]> = means.iter().map(Vec::as_slice).collect();
    let passes = solve(&states)?;
    let groups = parts.into_iter().zip(means).zip(passes);
    let groups = groups.map(|((rows, values), pass)| Group {
        share: rows.iter().map(|row| task.shares[*row]).sum(),
        rows,
        values,
        pass,
    });
    Ok(groups.collect())
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
