//! Does a chain of points cross itself? The chords are searched through a tree of boxes, so that a long chain costs about as much as
//! sorting its points.

use std::cell::Cell;

/// Two chords that are no neighbours and cross, by their first points.
#[must_use]
pub fn first(points: &[[f64; 2]]) -> Option<[[f64; 2]; 2]> {
    let chords = points.len().checked_sub(1).filter(|count| *count > 2)?;
    let tree = Tree::new(points, chords);
    let (i, j) = tree.within(points, 1, 0..tree.leaves)?;
    Some([points[i], points[j]])
}

/// Range of x and y.
type Box = [[f64; 2]; 2];

/// Boxes around halves of the chain, their halves and so on, as in a heap: node `k` holds `2k` and `2k + 1`.
struct Tree {
    boxes: Vec<Box>,
    /// Chords, and their number rounded up to a power of 2.
    chords: usize,
    leaves: usize,
    /// Pairs of boxes that were compared.
    looks: Cell<usize>,
}

const EMPTY: Box = [[f64::INFINITY, f64::NEG_INFINITY]; 2];

impl Tree {
    fn new(points: &[[f64; 2]], chords: usize) -> Tree {
        let leaves = chords.next_power_of_two();
        let mut boxes = vec![EMPTY; 2 * leaves];
        for (pair, own) in points.windows(2).zip(&mut boxes[leaves..]) {
            *own = [0, 1].map(|k| [pair[0][k].min(pair[1][k]), pair[0][k].max(pair[1][k])]);
        }
        for node in (1..leaves).rev() {
            let (left, right) = (boxes[2 * node], boxes[2 * node + 1]);
            boxes[node] =
                [0, 1].map(|k| [left[k][0].min(right[k][0]), left[k][1].max(right[k][1])]);
        }
        Tree {
            boxes,
            chords,
            leaves,
            looks: Cell::new(0),
        }
    }

    /// Two chords of one node that cross.
    fn within(
        &self,
        points: &[[f64; 2]],
        node: usize,
        range: std::ops::Range<usize>,
    ) -> Option<(usize, usize)> {
        if range.len() < 2 || range.start >= self.chords {
            return None;
        }
        let middle = range.start + range.len() / 2;
        let (left, right) = (range.start..middle, middle..range.end);
        self.within(points, 2 * node, left)
            .or_else(|| self.within(points, 2 * node + 1, right))
            .or_else(|| self.between(points, 2 * node, 2 * node + 1))
    }

    /// A chord of one node and one of a later node of the same size that cross.
    fn between(&self, points: &[[f64; 2]], one: usize, other: usize) -> Option<(usize, usize)> {
        self.looks.set(self.looks.get() + 1);
        let (a, b) = (&self.boxes[one], &self.boxes[other]);
        if (0..2).any(|k| a[k][1] < b[k][0] || b[k][1] < a[k][0]) {
            return None;
        }
        if one >= self.leaves {
            let (i, j) = (one - self.leaves, other - self.leaves);
            return (j > i + 1 && cross(points, i, j)).then_some((i, j));
        }
        [0, 1].into_iter().find_map(|left| {
            let lower = 2 * one + left;
            (0..2).find_map(|right| self.between(points, lower, 2 * other + right))
        })
    }
}

/// Do the chords that begin at two points cross?
fn cross(points: &[[f64; 2]], i: usize, j: usize) -> bool {
    let [a, b, c, d] = [i, i + 1, j, j + 1].map(|k| points[k]);
    let left = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]) > 0.0
    };
    left(a, b, c) != left(a, b, d) && left(c, d, a) != left(c, d, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every pair.
    fn by_pairs(points: &[[f64; 2]]) -> bool {
        let chords = points.len() - 1;
        (0..chords).any(|i| (i + 2..chords).any(|j| cross(points, i, j)))
    }

    /// A walk whose turns grow with `unrest`, from a fixed sequence.
    fn walk(seed: u64, count: usize, unrest: f64) -> Vec<[f64; 2]> {
        let mut state = seed;
        let mut angle = 0.0_f64;
        let mut at = [0.0; 2];
        let step = |_| {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            let part = (state >> 11) as f64 / (1_u64 << 53) as f64;
            angle += unrest * (part - 0.5);
            at = [at[0] + angle.cos(), at[1] + angle.sin()];
            at
        };
        (0..count).map(step).collect()
    }

    #[test]
    fn chains_cross_themselves_exactly_if_a_pair_of_chords_does() {
        let mut crossed = 0;
        for seed in 0..300 {
            let unrest = 0.06 * (seed % 100) as f64;
            let points = walk(seed, 3 + (seed as usize * 7) % 90, unrest);
            let found = first(&points);
            assert_eq!(found.is_some(), by_pairs(&points), "{seed}: {found:?}");
            crossed += usize::from(found.is_some());
        }
        assert!((30..270).contains(&crossed), "{crossed} of 300 cross");
    }

    #[test]
    fn a_long_chain_costs_little_more_than_its_points() {
        // Turns of a spiral lie in each other's boxes, as badly as a section can.
        let spiral = |k: usize| {
            let turn = 0.01 * k as f64;
            [turn * turn.cos(), turn * turn.sin()]
        };
        let points: Vec<[f64; 2]> = (0..20_000).map(spiral).collect();
        let tree = Tree::new(&points, points.len() - 1);
        assert_eq!(tree.within(&points, 1, 0..tree.leaves), None);
        let looks = tree.looks.get() / points.len();
        assert!(looks < 60, "{looks} looks a point");
        // One more chord, through all turns.
        let mut crossed = points;
        crossed.push([0.0, 0.1]);
        assert!(first(&crossed).is_some());
    }
}
