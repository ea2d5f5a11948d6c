//! Condenses a traffic to a few representative states.
//!
//! Rows are parted into groups, each represented by the mean of its rows. Both halves of every group along each column in which its rows differ are
//! solved too. Halves touch at different places, so that their wear reaches further than that of their mean: the wear of a state is spread by the
//! variance along the section that its halves add. The change of the wear that is left, summed over the columns, is the error of the groups. Until it
//! meets the tolerance, the groups that change most are replaced by the halves that change most.

use crate::contact::error::SolveError;
use crate::contact::evolution::pass::Pass;
use crate::contact::evolution::section::smoothed;
use crate::contact::evolution::task::{Evolution, SPACING};
use crate::contact::solution::words::evolution::{CondensedTraffic, TrafficState};

/// In each round the groups that change most are parted, this share of all.
const PARTED: f64 = 0.25;
/// A column in which the rows of a group differ by less than this part of the variance of the widest one is not parted.
const VARIANCE_SMALL: f64 = 0.01;

/// Rows with the wear of their mean.
#[derive(Debug)]
struct Group {
    rows: Vec<usize>,
    share: f64,
    values: Vec<f64>,
    /// Area in mm² that one pass of all rows removes at each point of the rail and of the wheel. Empty for a body that does not wear.
    area: [Vec<f64>; 2],
    parted: Option<Parted>,
}

/// Effect of halving a group.
#[derive(Debug)]
struct Parted {
    /// Change of the areas after spreading, summed over the columns.
    change: [Vec<f64>; 2],
    /// Variance in mm² along rail and wheel that the rows add to the wear of their mean.
    variance: [f64; 2],
    /// The halves that change most; none where the rows are alike.
    halves: Vec<Group>,
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
    let rows = (0..task.shares.len()).filter(|row| task.shares[*row] > 0.0);
    let mut groups = groups_of(task, vec![rows.collect()], solve)?;
    let columns = 0..task.columns.len();
    let scales: Vec<f64> = columns.map(|k| variance(task, k, &groups[0])).collect();
    let most = task.plan.accuracy.states_max as usize;
    loop {
        part(task, &scales, &mut groups, solve)?;
        let changes: Vec<&[Vec<f64>; 2]> = groups
            .iter()
            .flat_map(|group| &group.parted)
            .map(|parted| &parted.change)
            .collect();
        let total = [0, 1].map(|body| {
            let all: f64 = groups.iter().map(|group| size(&group.area[body])).sum();
            all.max(f64::MIN_POSITIVE)
        });
        let error = [0, 1].map(|body| {
            let mut all = vec![0.0; changes[0][body].len()];
            changes
                .iter()
                .for_each(|change| add(&mut all, 1.0, &change[body]));
            size(&all) / total[body]
        });
        if error[0].max(error[1]) <= task.plan.accuracy.states_tolerance || groups.len() >= most {
            let states = groups.into_iter().map(|group| TrafficState {
                share: group.share,
                rows: group.rows.len() as u32,
                values: group.values,
                spread_mm: group
                    .parted
                    .map_or([0.0; 2], |parted| parted.variance.map(f64::sqrt)),
            });
            return Ok(CondensedTraffic {
                rows: task.shares.len() as u32,
                pointers: task.pointers.clone(),
                states: states.collect(),
                error,
            });
        }
        let weight =
            |change: &[Vec<f64>; 2]| size(&change[0]) / total[0] + size(&change[1]) / total[1];
        let weights: Vec<f64> = changes.into_iter().map(weight).collect();
        let halves = |k: usize| groups[k].parted.as_ref().map(|parted| &parted.halves);
        let mut order: Vec<usize> = (0..groups.len())
            .filter(|k| halves(*k).is_some_and(|halves| !halves.is_empty()))
            .collect();
        order.sort_by(|a, b| weights[*b].total_cmp(&weights[*a]).then(a.cmp(b)));
        let count = (PARTED * groups.len() as f64).ceil() as usize;
        order.truncate(count.min(most - groups.len()));
        order.sort_unstable();
        for k in order.into_iter().rev() {
            if let Some(parted) = groups[k].parted.take() {
                groups.splice(k..=k, parted.halves);
            }
        }
    }
}

/// Solves the halves of the groups that have not been parted yet.
fn part(
    task: &Evolution,
    scales: &[f64],
    groups: &mut [Group],
    solve: &mut SolveStates,
) -> Result<(), SolveError> {
    let (mut owners, mut rows) = (Vec::new(), Vec::new());
    for (k, group) in groups.iter_mut().enumerate() {
        if group.parted.is_some() {
            continue;
        }
        group.parted = Some(Parted {
            change: [0, 1].map(|body| vec![0.0; group.area[body].len()]),
            variance: [0.0; 2],
            halves: Vec::new(),
        });
        let relative = |column: usize| match scales[column] > 0.0 {
            true => variance(task, column, group) / scales[column],
            false => 0.0,
        };
        let spreads: Vec<f64> = (0..scales.len()).map(relative).collect();
        let least = VARIANCE_SMALL * spreads.iter().copied().fold(0.0, f64::max);
        for column in (0..scales.len()).filter(|column| spreads[*column] > least) {
            let below = |row: &usize| task.columns[column][*row] < group.values[column];
            let (low, high): (Vec<usize>, Vec<usize>) =
                group.rows.iter().partition(|row| below(row));
            if !low.is_empty() && !high.is_empty() {
                owners.push((k, column));
                rows.extend([low, high]);
            }
        }
    }
    let mut solved = groups_of(task, rows, solve)?.into_iter();
    let mut largest = vec![f64::NEG_INFINITY; groups.len()];
    for (k, column) in owners {
        let halves: Vec<Group> = solved.by_ref().take(2).collect();
        let group = &mut groups[k];
        // Halves along a column have a part of the variance of its values, and of that along the sections.
        let between = halves
            .iter()
            .map(|half| half.share * (half.values[column] - group.values[column]).powi(2));
        let factor = variance(task, column, group) / between.sum::<f64>();
        let Some(parted) = &mut group.parted else {
            continue;
        };
        let mut own = 0.0;
        for (body, mean) in group.area.iter().enumerate() {
            let mut both = halves[0].area[body].clone();
            add(&mut both, 1.0, &halves[1].area[body]);
            let added = (along_variance(&both) - along_variance(mean)).max(0.0);
            let change = |mean: &[f64]| {
                let mut change = both.clone();
                add(&mut change, -1.0, mean);
                change
            };
            let (unspread, spread) = (change(mean), change(&smoothed(mean, SPACING, added.sqrt())));
            // Halves that touch at two places far apart have little in between.
            let change = if size(&spread) < size(&unspread) {
                parted.variance[body] += factor * added;
                spread
            } else {
                unspread
            };
            add(&mut parted.change[body], 1.0, &change);
            own += size(&change) / size(mean).max(f64::MIN_POSITIVE);
        }
        if own > largest[k] {
            largest[k] = own;
            parted.halves = halves;
        }
    }
    Ok(())
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
    let wearing = task.plan.wearing.flags();
    let groups = parts.into_iter().zip(means).zip(passes);
    let groups = groups.map(|((rows, values), pass)| {
        let share = rows.iter().map(|row| task.shares[*row]).sum();
        let mut wear = pass.wear.into_iter().zip(wearing);
        let mut area = || match wear.next() {
            Some((wear, true)) => wear.area.iter().map(|area| share * area).collect(),
            _ => Vec::new(),
        };
        Group {
            area: [area(), area()],
            rows,
            share,
            values,
            parted: None,
        }
    });
    Ok(groups.collect())
}

/// Sum of the sizes.
fn size(areas: &[f64]) -> f64 {
    areas.iter().map(|area| area.abs()).sum()
}

fn add(to: &mut [f64], factor: f64, from: &[f64]) {
    to.iter_mut()
        .zip(from)
        .for_each(|(to, from)| *to += factor * from);
}

/// Variance in mm² of the place along the section at which areas lie; 0 where there are none.
fn along_variance(areas: &[f64]) -> f64 {
    let moments = areas.iter().enumerate().fold([0.0; 3], |sums, (k, area)| {
        let s = SPACING * k as f64;
        [sums[0] + area, sums[1] + area * s, sums[2] + area * s * s]
    });
    let [all, first, second] = moments;
    match all > 0.0 {
        true => second / all - (first / all).powi(2),
        false => 0.0,
    }
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

/// Sum over the rows of a group of share times squared distance from the mean of a column.
fn variance(task: &Evolution, column: usize, group: &Group) -> f64 {
    let off = |row: &usize| task.columns[column][*row] - group.values[column];
    let rows = group.rows.iter();
    rows.map(|row| task.shares[*row] * off(row).powi(2)).sum()
}
