//! Connected groups of grid cells.

/// Groups the cells of a `width` by `height` grid for which the predicate is true (cell (i, j) is `j * width + i`). Cells that share
/// an edge or a corner are connected. Groups are ordered by their first cells, cells within a group by when they were
/// reached.
pub(crate) fn groups(
    [width, height]: [usize; 2],
    inside: impl Fn(usize) -> bool,
) -> Vec<Vec<usize>> {
    let mut seen = vec![false; width * height];
    let mut groups = Vec::new();
    for start in 0..width * height {
        if seen[start] || !inside(start) {
            continue;
        }
        seen[start] = true;
        let mut group = vec![start];
        let mut next = 0;
        while let Some(&cell) = group.get(next) {
            next += 1;
            let (i, j) = (cell % width, cell / width);
            for j in j.saturating_sub(1)..(j + 2).min(height) {
                for i in i.saturating_sub(1)..(i + 2).min(width) {
                    let neighbour = j * width + i;
                    if !seen[neighbour] && inside(neighbour) {
                        seen[neighbour] = true;
                        group.push(neighbour);
                    }
                }
            }
        }
        groups.push(group);
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_connect_and_the_ends_of_a_row_do_not() {
        // Two diagonals that touch at a corner, and a cell at the far end of the next row.
        let map = ["x...", ".x.x", "..x.", "...."];
        let inside = |cell: usize| map[cell / 4].as_bytes()[cell % 4] == b'x';
        assert_eq!(groups([4, 4], inside), [vec![0, 5, 10, 7]]);
        let ends = ["..xx", "x...", "...."];
        let inside = |cell: usize| ends[cell / 4].as_bytes()[cell % 4] == b'x';
        assert_eq!(groups([4, 3], inside), [vec![2, 3], vec![4]]);
        assert!(groups([0, 0], |_| true).is_empty());
    }
}
