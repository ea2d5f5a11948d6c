//! Directed edges between corners, joined to simple loops.

use std::collections::{BTreeMap, BTreeSet};

/// A corner as the ranks of its x and y among the distinct cell edges.
pub(crate) type Corner = (usize, usize);

/// Joins directed edges to loops that visit every corner at most once.
///
/// At a corner where two cells meet diagonally the walk turns left, which keeps the two apart; if it comes back to a
/// corner it has already passed, the part in between is a loop of its own (a hole that touches the outside).
pub(crate) fn chain(edges: Vec<(Corner, Corner)>) -> Vec<Vec<Corner>> {
    let mut leaving: BTreeMap<Corner, BTreeSet<Corner>> = BTreeMap::new();
    for (from, to) in edges {
        leaving.entry(from).or_default().insert(to);
    }
    let mut loops = Vec::new();
    while let Some((&start, _)) = leaving.first_key_value() {
        let mut path: Vec<Corner> = vec![start];
        let mut place: BTreeMap<Corner, usize> = BTreeMap::from([(start, 0)]);
        while let Some(&here) = path.last() {
            let before = path.len().checked_sub(2).map(|k| path[k]);
            let Some(next) = take_next(&mut leaving, before, here) else {
                break;
            };
            if let Some(&first) = place.get(&next) {
                for corner in &path[first + 1..] {
                    place.remove(corner);
                }
                loops.push(path.split_off(first));
                path.push(next);
                if path.len() == 1 {
                    break;
                }
            } else {
                place.insert(next, path.len());
                path.push(next);
            }
        }
    }
    loops
}

/// Takes the edge that leaves `here`, the leftmost turn seen from `before` if there are two.
fn take_next(
    leaving: &mut BTreeMap<Corner, BTreeSet<Corner>>,
    before: Option<Corner>,
    here: Corner,
) -> Option<Corner> {
    let ways = leaving.get_mut(&here)?;
    let turns_left = |to: &Corner| before.is_some_and(|before| turn(before, here, *to) > 0);
    let next = ways
        .iter()
        .copied()
        .find(turns_left)
        .or_else(|| ways.first().copied())?;
    ways.remove(&next);
    if ways.is_empty() {
        leaving.remove(&here);
    }
    Some(next)
}

/// Sign of the turn from `a` over `b` to `c`: 1 left, −1 right, 0 straight.
fn turn(a: Corner, b: Corner, c: Corner) -> i64 {
    let step = |from: Corner, to: Corner| {
        (
            i64::from(to.0 > from.0) - i64::from(to.0 < from.0),
            i64::from(to.1 > from.1) - i64::from(to.1 < from.1),
        )
    };
    let (p, q) = (step(a, b), step(b, c));
    p.0 * q.1 - p.1 * q.0
}

/// Drops corners that are passed straight on, and starts at the lowest, then leftmost corner.
pub(crate) fn straighten(corners: &[Corner]) -> Vec<Corner> {
    let n = corners.len();
    let mut kept: Vec<Corner> = (0..n)
        .filter(|&k| turn(corners[(k + n - 1) % n], corners[k], corners[(k + 1) % n]) != 0)
        .map(|k| corners[k])
        .collect();
    let lowest = (0..kept.len())
        .min_by_key(|&k| (kept[k].1, kept[k].0))
        .unwrap_or(0);
    kept.rotate_left(lowest);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x: usize, y: usize) -> [(Corner, Corner); 4] {
        let c = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)];
        [0, 1, 2, 3].map(|k| (c[k], c[(k + 1) % 4]))
    }

    #[test]
    fn squares_that_meet_in_a_corner_stay_two_loops() {
        let edges = [square(0, 0), square(1, 1)].concat();
        let loops = chain(edges);
        assert_eq!(
            loops,
            vec![
                vec![(0, 0), (1, 0), (1, 1), (0, 1)],
                vec![(1, 1), (2, 1), (2, 2), (1, 2)]
            ]
        );
    }

    #[test]
    fn corners_passed_straight_on_are_dropped_and_the_lowest_comes_first() {
        let corners = [(4, 3), (2, 3), (1, 3), (1, 0), (4, 0)];
        assert_eq!(straighten(&corners), vec![(1, 0), (4, 0), (4, 3), (1, 3)]);
    }
}
