//! Condenses a traffic to a few representative states.
//!
//! Rows are parted into groups, each represented by the mean of its rows. The error is measured: every group is parted once more, both halves are
//! solved, and the change of the sum of all wear is the error of the groups. Until it meets the tolerance, the groups that change most are
//! replaced by their halves.

use crate::contact::error::SolveError;
use crate::contact::evolution::pass::{BodyWear, Pass};
use crate::contact::evolution::task::Evolution;
use crate::contact::solution::words::evolution::{CondensedTraffic, TrafficState};

/// Groups to begin with.
const GROUPS_FIRST: usize = 4;
/// In each round the groups that change most are parted, this share of all.
const PARTED: f64 = 0.25;

/// Rows with the wear of their mean.
#[derive(Debug, Clone)]
struct Group {
    rows: Vec<usize>,
    share: f64,
    values: Vec<f64>,
    pass: Pass,
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
        let spread =
            |rows: &Vec<usize>| widest(task, &scales, rows).map_or(0.0, |(_, spread)| spread);
        let next =
            (0..parts.len()).max_by(|a, b| spread(&parts[*a]).total_cmp(&spread(&parts[*b])));
        let Some([low, high]) = next.and_then(|k| halves(task, &scales, &parts[k])) else {
            break;
        };
        let next = next.unwrap_or(0);
        parts.splice(next..=next, [low, high]);
    }
    let most = task.plan.accuracy.states_max as usize;
    let mut group = |rows: Vec<usize>| group(task, rows, solve);
    let mut groups = parts
        .into_iter()
        .map(&mut group)
        .collect::<Result<Vec<Group>, SolveError>>()?;
    let mut halved: Vec<Option<[Group; 2]>> = vec![None; groups.len()];
    let mut known = vec![false; groups.len()];
    loop {
        for k in 0..groups.len() {
            if !known[k] {
                let parts = halves(task, &scales, &groups[k].rows);
                halved[k] = match parts {
                    Some([low, high]) => Some([group(low)?, group(high)?]),
                    None => None,
                };
                known[k] = true;
            }
        }
        let changes: Vec<[BodyWear; 2]> = (0..groups.len())
            .map(|k| change(&groups[k], halved[k].as_ref()))
            .collect();
        let total = [0, 1].map(|body| {
            let mut all = BodyWear::none(groups[0].pass.wear[body].area.len());
            groups
                .iter()
                .for_each(|group| all.add(group.share, &group.pass.wear[body]));
            size(&all).max(f64::MIN_POSITIVE)
        });
        let error = [0, 1].map(|body| {
            let mut all = BodyWear::none(changes[0][body].area.len());
            changes
                .iter()
                .for_each(|change| all.add(1.0, &change[body]));
            size(&all) / total[body]
        });
        let wearing = task.plan.wearing.flags();
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
        let weight = |k: usize| {
            (0..2)
                .filter(|body| wearing[*body])
                .map(|body| size(&changes[k][body]) / total[body])
                .sum::<f64>()
        };
        let mut order: Vec<usize> = (0..groups.len()).filter(|k| halved[*k].is_some()).collect();
        order.sort_by(|a, b| weight(*b).total_cmp(&weight(*a)).then(a.cmp(b)));
        let count = (PARTED * groups.len() as f64).ceil() as usize;
        order.truncate(count.min(most - groups.len()));
        if order.is_empty() {
            // Nothing can be parted: every group is a row, and `change` was 0.
            order.clear();
        }
        order.sort_unstable();
        for k in order.into_iter().rev() {
            if let Some([low, high]) = halved[k].take() {
                groups.splice(k..=k, [low, high]);
                halved.splice(k..=k, [None, None]);
                known.splice(k..=k, [false, false]);
            }
        }
    }
}

/// Sum of the sizes of the areas.
fn size(wear: &BodyWear) -> f64 {
    wear.area.iter().map(|area| area.abs()).sum()
}

/// What the halves of a group wear more than itself.
fn change(group: &Group, halves: Option<&[Group; 2]>) -> [BodyWear; 2] {
    [0, 1].map(|body| {
        let mut sum = BodyWear::none(group.pass.wear[body].area.len());
        if let Some(halves) = halves {
            sum.add(-group.share, &group.pass.wear[body]);
            halves
                .iter()
                .for_each(|half| sum.add(half.share, &half.pass.wear[body]));
        }
        sum
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

/// The column in which rows differ most, relative to its scale, and by how much.
fn widest(task: &Evolution, scales: &[f64], rows: &[usize]) -> Option<(usize, f64)> {
    let spreads = task
        .columns
        .iter()
        .zip(scales)
        .enumerate()
        .filter(|(_, (_, scale))| **scale > 0.0);
    let spreads =
        spreads.map(|(k, (column, scale))| (k, variance(task, rows, column) / scale.powi(2)));
    spreads
        .filter(|(_, spread)| *spread > 0.0)
        .max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Rows below and above the mean of the column in which they differ most; nothing where they are alike.
fn halves(task: &Evolution, scales: &[f64], rows: &[usize]) -> Option<[Vec<usize>; 2]> {
    let (k, _) = widest(task, scales, rows)?;
    let column = &task.columns[k];
    let mean = mean(task, rows, column);
    let (low, high): (Vec<usize>, Vec<usize>) = rows.iter().partition(|row| column[**row] < mean);
    (!low.is_empty() && !high.is_empty()).then_some([low, high])
}
