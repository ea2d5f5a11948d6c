//! Closed curves around the part of a grid whose values reach a level.

use std::collections::BTreeMap;

/// Values at the nodes of a grid, row by row; the grid may be curved.
pub(crate) struct CurvedGrid<'a> {
    /// Nodes of a row.
    pub columns: usize,
    /// One value per node.
    pub values: &'a [f64],
    /// The place of each node in mm.
    pub places: &'a [[f64; 2]],
}

impl CurvedGrid<'_> {
    /// The value at a node of the grid with a ring of nodes around it that reach no level.
    fn value(&self, i: usize, j: usize) -> f64 {
        let rows = self.values.len() / self.columns;
        if i == 0 || j == 0 || i > self.columns || j > rows {
            return f64::NEG_INFINITY;
        }
        self.values[(j - 1) * self.columns + i - 1]
    }

    fn place(&self, i: usize, j: usize) -> [f64; 2] {
        let rows = self.values.len() / self.columns;
        let (i, j) = (i.clamp(1, self.columns), j.clamp(1, rows));
        self.places[(j - 1) * self.columns + i - 1]
    }

    /// Where the level is crossed between two nodes, linearly; at the border of the grid the border itself.
    fn crossing(&self, one: (usize, usize), two: (usize, usize), level: f64) -> [f64; 2] {
        let (a, b) = (self.value(one.0, one.1), self.value(two.0, two.1));
        let (from, to) = (self.place(one.0, one.1), self.place(two.0, two.1));
        let share = if a.is_infinite() {
            1.0
        } else if b.is_infinite() {
            0.0
        } else {
            ((level - a) / (b - a)).clamp(0.0, 1.0)
        };
        [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]))
    }
}

/// An edge of the grid: its lower node, and whether it goes to the next row.
type GridEdge = (usize, usize, bool);

/// Closed curves with what reaches the level on their left (marching squares; W. E. Lorensen and H. E. Cline, 1987, in two dimensions).
/// Where two parts meet in one square, the mean of its corners decides whether they are joined.
pub(crate) fn contours(grid: &CurvedGrid, level: f64) -> Vec<Vec<[f64; 2]>> {
    let rows = grid.values.len() / grid.columns;
    let mut next: BTreeMap<GridEdge, GridEdge> = BTreeMap::new();
    for j in 0..=rows {
        for i in 0..=grid.columns {
            link_square(grid, (i, j), level, &mut next);
        }
    }
    let mut loops = Vec::new();
    while let Some((&start, _)) = next.first_key_value() {
        let mut points = Vec::new();
        let mut here = start;
        while let Some(to) = next.remove(&here) {
            let (i, j, upward) = here;
            let end = if upward { (i, j + 1) } else { (i + 1, j) };
            points.push(grid.crossing((i, j), end, level));
            here = to;
        }
        loops.push(points);
    }
    loops
}

/// Adds the pieces within the square whose lower left node is given.
fn link_square(
    grid: &CurvedGrid,
    (i, j): (usize, usize),
    level: f64,
    next: &mut BTreeMap<GridEdge, GridEdge>,
) {
    let values = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| grid.value(i, j));
    let edges: [GridEdge; 4] = [
        (i, j, false),
        (i + 1, j, true),
        (i, j + 1, false),
        (i, j, true),
    ];
    let inside = values.map(|value| value >= level);
    let joined = 0.25 * values.iter().sum::<f64>() >= level;
    for side in 0..4 {
        if !inside[side] || inside[(side + 1) % 4] {
            continue;
        }
        // The curve leaves the square where what is inside ends, and comes back where it begins.
        let begins = |step: usize| !inside[(side + step) % 4] && inside[(side + step + 1) % 4];
        let found = if joined {
            (1..4).find(|&step| begins(step))
        } else {
            (1..4).rev().find(|&step| begins(step))
        };
        if let Some(step) = found {
            next.insert(edges[side], edges[(side + step) % 4]);
        }
    }
}

/// Area of a closed curve, positive if it runs counter-clockwise.
pub(crate) fn signed_area(points: &[[f64; 2]]) -> f64 {
    let following = points.iter().cycle().skip(1);
    let pairs = points.iter().zip(following);
    0.5 * pairs.map(|(a, b)| a[0] * b[1] - b[0] * a[1]).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cone_is_cut_in_a_circle_and_the_border_closes_what_it_cuts() {
        let places: Vec<[f64; 2]> = (0..41)
            .flat_map(|j| {
                (0..41).map(move |i| [f64::from(i) * 0.05 - 1.0, f64::from(j) * 0.05 - 1.0])
            })
            .collect();
        let values: Vec<f64> = places.iter().map(|[x, y]| 1.0 - x.hypot(*y)).collect();
        let grid = CurvedGrid {
            columns: 41,
            values: &values,
            places: &places,
        };
        let circle = contours(&grid, 0.5);
        assert_eq!(circle.len(), 1);
        let expected = std::f64::consts::PI * 0.25;
        assert!((signed_area(&circle[0]) - expected).abs() < 5e-3);
        let cut = contours(&grid, -0.2);
        assert_eq!(cut.len(), 1, "the sides of the square close it");
        // A circle of radius 1.2 in a square of side 2.
        let round =
            4.0 * 0.44_f64.sqrt() + 1.44 * (std::f64::consts::PI - 4.0 * (1.0_f64 / 1.2).acos());
        assert!((signed_area(&cut[0]) - round).abs() < 1e-2);
        let holes: Vec<f64> = values.iter().map(|value| -value).collect();
        let grid = CurvedGrid {
            columns: 41,
            values: &holes,
            places: &places,
        };
        let areas: Vec<f64> = contours(&grid, -0.5)
            .iter()
            .map(|l| signed_area(l))
            .collect();
        assert_eq!(areas.len(), 2);
        assert!(
            (areas.iter().sum::<f64>() - (4.0 - expected)).abs() < 5e-3,
            "{areas:?}"
        );
    }
}
