//! Connected groups of grid cells.

/// Adjoining cells of a row, from the first to one after the last, and a run of the same group before it (its own number if there is none).
#[derive(Clone, Copy)]
struct RowRun {
    from: usize,
    to: usize,
    parent: usize,
}

/// Groups the cells of a `width` by `height` grid for which the predicate is true (cell (i, j) is `j * width + i`). Cells that share
/// an edge or a corner are connected. Groups are ordered by their first cells, cells within a group by their numbers.
pub(crate) fn groups(
    [width, height]: [usize; 2],
    inside: impl Fn(usize) -> bool,
) -> Vec<Vec<usize>> {
    let mut runs: Vec<RowRun> = Vec::new();
    // The runs of the previous row.
    let mut above = 0..0;
    for j in 0..height {
        let (first, row) = (runs.len(), j * width);
        let mut i = 0;
        while i < width {
            if !inside(row + i) {
                i += 1;
                continue;
            }
            let from = i;
            while i < width && inside(row + i) {
                i += 1;
            }
            let parent = runs.len();
            runs.push(RowRun {
                from: row + from,
                to: row + i,
                parent,
            });
            // Runs of the previous row that touch it at an edge or a corner.
            for k in above.clone() {
                let (low, high) = (runs[k].from + width, runs[k].to + width);
                if low <= row + i && high >= row + from {
                    join(&mut runs, k, parent);
                }
            }
        }
        above = first..runs.len();
    }
    let mut sizes = vec![0; runs.len()];
    for (k, run) in runs.iter().enumerate() {
        sizes[root(&runs, k)] += run.to - run.from;
    }
    let mut places = vec![usize::MAX; runs.len()];
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (k, run) in runs.iter().enumerate() {
        let root = root(&runs, k);
        if places[root] == usize::MAX {
            places[root] = groups.len();
            groups.push(Vec::with_capacity(sizes[root]));
        }
        groups[places[root]].extend(run.from..run.to);
    }
    groups
}

fn root(runs: &[RowRun], mut k: usize) -> usize {
    while runs[k].parent != k {
        k = runs[k].parent;
    }
    k
}

fn join(runs: &mut [RowRun], one: usize, other: usize) {
    let (one, other) = (root(runs, one), root(runs, other));
    runs[one.max(other)].parent = one.min(other);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_connect_and_the_ends_of_a_row_do_not() {
        // Two diagonals that touch at a corner, and a cell at the far end of the next row.
        let map = ["x...", ".x.x", "..x.", "...."];
        let inside = |cell: usize| map[cell / 4].as_bytes()[cell % 4] == b'x';
        assert_eq!(groups([4, 4], inside), [vec![0, 5, 7, 10]]);
        let ends = ["..xx", "x...", "...."];
        let inside = |cell: usize| ends[cell / 4].as_bytes()[cell % 4] == b'x';
        assert_eq!(groups([4, 3], inside), [vec![2, 3], vec![4]]);
        let fork = ["x..x", "x..x", ".xx."];
        let inside = |cell: usize| fork[cell / 4].as_bytes()[cell % 4] == b'x';
        assert_eq!(groups([4, 3], inside), [vec![0, 3, 4, 7, 9, 10]]);
        assert!(groups([0, 0], |_| true).is_empty());
    }
}
