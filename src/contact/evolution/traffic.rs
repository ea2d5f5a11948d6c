//! Condenses a traffic to a few representative states.
//!
//! Rows are divided into groups, each represented by the mean of its rows. Both halves of every group along each column in which its rows differ are
//! solved too. Halves touch at different positions, so that their wear extends further than that of their mean. The wear of a state is therefore
//! spread by the variance along the section that its halves add. The remaining change of the wear, summed over the columns, is the error of the
//! groups. Until it meets the tolerance, the groups with the largest change are replaced by their halves along the column with the largest change.

use crate::error::SolveError;
use crate::evolution::pass::Pass;
use crate::evolution::section::{add, smoothed};
use crate::evolution::task::Evolution;
use crate::geometry::profile::POINT_SPACING;
use crate::solution::words::evolution::{CondensedTraffic, TrafficState};

/// Share of the groups that are divided in each round.
const PARTED: f64 = 0.25;
/// Variance of a column, relative to that of the column with the largest variance, up to which a group is not divided along it.
const VARIANCE_SMALL: f64 = 0.01;

/// A group of rows, with the wear of their mean.
#[derive(Debug)]
struct Group {
    rows: Vec<usize>,
    share: f64,
    values: Vec<f64>,
    /// Area in mm² that one pass of all rows removes at each point of the rail and of the wheel. Empty for a body that does not wear.
    area: [Vec<f64>; 2],
    /// Whether the halves were solved.
    parted: bool,
    /// Change of the areas by halving, after spreading, summed over the columns.
    change: [Vec<f64>; 2],
    /// Variance in mm² along rail and wheel that the rows add to the wear of their mean.
    variance: [f64; 2],
    /// The halves along the column with the largest change; empty if all rows are equal.
    halves: Vec<Group>,
}

/// Solves the states with these values, each for one pass.
pub(crate) type SolveStates<'a> = dyn FnMut(&[&[f64]]) -> Result<Vec<Pass>, SolveError> + 'a;

/// Condenses a traffic to a few states.
///
/// # Errors
/// Returns the errors of `solve`.
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
        let total = [0, 1].map(|body| {
            let all: f64 = groups.iter().map(|group| size(&group.area[body])).sum();
            all.max(f64::MIN_POSITIVE)
        });
        let error = [0, 1].map(|body| {
            let mut all = vec![0.0; groups[0].change[body].len()];
            let changes = groups.iter().map(|group| &group.change[body]);
            changes.for_each(|change| add(&mut all, 1.0, change));
            size(&all) / total[body]
        });
        if error[0].max(error[1]) <= task.plan.accuracy.states_tolerance || groups.len() >= most {
            let states = groups.into_iter().map(|group| TrafficState {
                share: group.share,
                rows: group.rows.len() as u32,
                values: group.values,
                spread_mm: group.variance.map(f64::sqrt),
            });
            return Ok(CondensedTraffic {
                rows: task.shares.len() as u32,
                pointers: task.pointers.clone(),
                states: states.collect(),
                error,
            });
        }
        let weight = |k: usize| {
            let [rail, wheel] = &groups[k].change;
            size(rail) / total[0] + size(wheel) / total[1]
        };
        let weights: Vec<f64> = (0..groups.len()).map(weight).collect();
        let parted = (0..groups.len()).filter(|k| !groups[*k].halves.is_empty());
        let mut order: Vec<usize> = parted.collect();
        order.sort_by(|a, b| weights[*b].total_cmp(&weights[*a]).then(a.cmp(b)));
        let count = (PARTED * groups.len() as f64).ceil() as usize;
        order.truncate(count.min(most - groups.len()));
        order.sort_unstable();
        for k in order.into_iter().rev() {
            let halves = std::mem::take(&mut groups[k].halves);
            groups.splice(k..=k, halves);
        }
    }
}

/// Solves the halves of the groups whose halves were not solved yet.
fn part(
    task: &Evolution,
    scales: &[f64],
    groups: &mut [Group],
    solve: &mut SolveStates,
) -> Result<(), SolveError> {
    let (mut owners, mut rows) = (Vec::new(), Vec::new());
    let unparted = groups.iter_mut().enumerate();
    for (k, group) in unparted.filter(|(_, group)| !group.parted) {
        group.parted = true;
        // The variance relative to that of all rows; 0 if all values of a column are equal.
        let relative =
            |column: usize| variance(task, column, group) / scales[column].max(f64::MIN_POSITIVE);
        let spreads: Vec<f64> = (0..scales.len()).map(relative).collect();
        let least = VARIANCE_SMALL * spreads.iter().copied().fold(0.0, f64::max);
        for column in (0..scales.len()).filter(|column| spreads[*column] > least) {
            let below = |row: &usize| task.columns[column][*row] < group.values[column];
            let parts = group.rows.iter().copied().partition(below);
            let (low, high): (Vec<usize>, Vec<usize>) = parts;
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
        // Halves along a column have a part of the variance of its values, and the same part of the variance along the sections.
        let off = |half: &Group| half.values[column] - group.values[column];
        let between = halves.iter().map(|half| half.share * off(half).powi(2));
        let factor = variance(task, column, group) / between.sum::<f64>();
        let mut own = 0.0;
        for (body, mean) in group.area.iter().enumerate() {
            let mut both = halves[0].area[body].clone();
            add(&mut both, 1.0, &halves[1].area[body]);
            let added = (along_variance(&both) - along_variance(mean)).max(0.0);
            let mut spread = both.clone();
            add(&mut spread, -1.0, &smoothed(mean, added.sqrt()));
            let mut change = both;
            add(&mut change, -1.0, mean);
            // Halves that touch far apart have little wear in between, so that spreading may not help.
            if size(&spread) < size(&change) {
                group.variance[body] += factor * added;
                change = spread;
            }
            add(&mut group.change[body], 1.0, &change);
            own += size(&change) / size(mean).max(f64::MIN_POSITIVE);
        }
        if own > largest[k] {
            largest[k] = own;
            group.halves = halves;
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
        let area = [0, 1].map(|body| {
            let area = pass.wear[body].area.iter().filter(|_| wearing[body]);
            area.map(|area| share * area).collect::<Vec<f64>>()
        });
        Group {
            rows,
            share,
            values,
            parted: false,
            change: [0, 1].map(|body| vec![0.0; area[body].len()]),
            variance: [0.0; 2],
            halves: Vec::new(),
            area,
        }
    });
    Ok(groups.collect())
}

/// Sum of the absolute values.
fn size(areas: &[f64]) -> f64 {
    areas.iter().map(|area| area.abs()).sum()
}

/// Variance in mm² of the positions of areas along the section; 0 if all areas are 0.
fn along_variance(areas: &[f64]) -> f64 {
    let moments = areas.iter().enumerate().fold([0.0; 3], |sums, (k, area)| {
        let s = POINT_SPACING * k as f64;
        [sums[0] + area, sums[1] + area * s, sums[2] + area * s * s]
    });
    let [all, first, second] = moments;
    let all = all.max(f64::MIN_POSITIVE);
    second / all - (first / all).powi(2)
}

/// Mean of a column over some rows, weighted with their shares.
fn mean(task: &Evolution, rows: &[usize], column: &[f64]) -> f64 {
    let first = column[rows[0]];
    // Differences from the first value are summed, so that the mean of equal values is exact.
    let (mut share, mut sum) = (0.0, 0.0);
    for row in rows {
        share += task.shares[*row];
        sum += task.shares[*row] * (column[*row] - first);
    }
    first + sum / share
}

/// Sum of the squared deviations of a column from its mean over the rows of a group, weighted with their shares.
fn variance(task: &Evolution, column: usize, group: &Group) -> f64 {
    let off = |row: &usize| task.columns[column][*row] - group.values[column];
    let rows = group.rows.iter();
    rows.map(|row| task.shares[*row] * off(row).powi(2)).sum()
}
