//! A simply connected patch as a curved grid that ends at its border, contours of fields on it, and the border of the stick zone.
//!
//! A node lies at a fixed share of the chord at its y, so that contours near the border are smooth.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::iter::once;

use super::monotone::monotone;
use super::outlines::{StoredSegment, Strips};
use railhead_contact::solution::words::answer::{PatchCells, PointFields, Zone};

/// Least and largest number of nodes along one axis. In between, there are four per cell or strip.
const NODES: [usize; 2] = [65, 257];
/// Least number of strips for interpolation between them.
const STRIPS_MIN: usize = 3;

/// Behaviour of a field at the border of the patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AtBorder {
    /// It vanishes like the square root of the distance: pressure and traction.
    Vanishes,
    /// It continues as in the outermost cells.
    Continues,
}

/// A curved grid over a patch.
#[derive(Debug, Clone)]
pub(crate) struct Sheet {
    pub(crate) strips: Vec<StoredSegment>,
    /// y of the lowest point of the border, of the strips, and of the highest point, in mm.
    heights: Vec<f64>,
    /// Positions of the nodes on the chord, from 0 to 1.
    pub(crate) shares: Vec<f64>,
    /// y of the rows of nodes in mm.
    rows: Vec<f64>,
    places: Vec<[f64; 2]>,
}

impl Sheet {
    /// Creates the grid over a patch; `None` if the patch has fewer than three strips, or gaps.
    ///
    /// Between the mid-lines of strips, the squared half-length and the centre of the chord are monotone cubics, so that the border of an ellipse
    /// is round even with few strips. The ends are those of [`patch_outline`](super::outlines::patch_outline).
    #[must_use]
    pub(crate) fn new(cells: &PatchCells) -> Option<Sheet> {
        let found = Strips::new(cells);
        if !found.is_simple() || found.segments.len() < STRIPS_MIN {
            return None;
        }
        let segments = &found.segments;
        let last = segments.len() - 1;
        let [low, high] = [&segments[0], &segments[last]];
        let middles = segments.iter().map(|segment| segment.y);
        let heights = between(low.y - 0.5 * low.dy, middles, high.y + 0.5 * high.dy);
        let chords = segments.iter().map(|segment| (segment.left, segment.right));
        let ends = between(found.tip(0, false), chords, found.tip(last, true));
        let longest = segments.iter().map(|s| s.cells.len()).max().unwrap_or(0);
        let shares = chebyshev(longest);
        let (from, to) = (heights[0], heights[heights.len() - 1]);
        let rows: Vec<f64> = chebyshev(segments.len())
            .into_iter()
            .map(|share| from + share * (to - from))
            .collect();
        let centres: Vec<f64> = ends.iter().map(|(l, r)| 0.5 * (l + r)).collect();
        let squares: Vec<f64> = ends.iter().map(|(l, r)| (0.5 * (r - l)).powi(2)).collect();
        let centres = monotone(&heights, &centres, &rows);
        let squares = monotone(&heights, &squares, &rows);
        let places = (0..rows.len())
            .flat_map(|row| {
                let (centre, half) = (centres[row], squares[row].max(0.0).sqrt());
                let y = rows[row];
                shares
                    .iter()
                    .map(move |share| [centre + (2.0 * share - 1.0) * half, y])
            })
            .collect();
        Some(Sheet {
            strips: found.segments,
            heights,
            shares,
            rows,
            places,
        })
    }

    /// Returns the border of the patch in mm, counter-clockwise.
    #[must_use]
    pub(crate) fn border(&self) -> Vec<[f64; 2]> {
        let columns = self.shares.len();
        let leading = (0..self.rows.len()).map(|row| self.places[(row + 1) * columns - 1]);
        let trailing = (0..self.rows.len())
            .rev()
            .map(|row| self.places[row * columns]);
        leading.chain(trailing).collect()
    }

    /// Returns the bounding box `[x_min, x_max, y_min, y_max]` of the border in mm.
    #[must_use]
    pub(crate) fn extent(&self) -> [f64; 4] {
        bounds(self.places.iter().copied())
    }

    /// Interpolates values of cells at the nodes, by monotone cubics along every strip and then between strips at equal shares of the chords.
    /// The result never exceeds the values of the cells. A field that vanishes at the border is interpolated by its square, which is exact for
    /// the pressure of Hertz.
    ///
    /// # Panics
    /// If there are fewer values than cells.
    #[must_use]
    pub(crate) fn nodes(&self, values: &[f64], cells: &PatchCells, edge: AtBorder) -> Vec<f64> {
        let strips = self.strips.iter().map(|strip| {
            let width = strip.right - strip.left;
            let inside = strip.cells.clone();
            let power = |cell: usize| match edge {
                AtBorder::Vanishes => values[cell].powi(2),
                AtBorder::Continues => values[cell],
            };
            let of_end = |cell: usize| match edge {
                AtBorder::Vanishes => 0.0,
                AtBorder::Continues => values[cell],
            };
            let share = |cell: usize| (cells.x_mm[cell] - strip.left) / width;
            let knots = between(0.0, inside.clone().map(share), 1.0);
            let [first, last] = [inside.start, inside.end - 1].map(of_end);
            let heights = between(first, inside.map(power), last);
            monotone(&knots, &heights, &self.shares)
        });
        let strips: Vec<Vec<f64>> = strips.collect();
        let mut nodes = self.across(&strips, edge);
        if edge == AtBorder::Vanishes {
            nodes
                .iter_mut()
                .for_each(|value| *value = value.max(0.0).sqrt());
        }
        nodes
    }

    /// Interpolates between strips from values at the nodes of every strip.
    fn across(&self, strips: &[Vec<f64>], edge: AtBorder) -> Vec<f64> {
        let (columns, last) = (self.shares.len(), strips.len() - 1);
        let mut nodes = vec![0.0; columns * self.rows.len()];
        for column in 0..columns {
            let outer = |strip: usize| match edge {
                AtBorder::Vanishes => 0.0,
                AtBorder::Continues => strips[strip][column],
            };
            let middles = strips.iter().map(|strip| strip[column]);
            let knots = between(outer(0), middles, outer(last));
            let along = monotone(&self.heights, &knots, &self.rows);
            for (row, value) in along.into_iter().enumerate() {
                nodes[row * columns + column] = value;
            }
        }
        nodes
    }

    /// Returns closed curves around the part of the patch where a field reaches a level, counter-clockwise, holes clockwise.
    #[must_use]
    pub(crate) fn reaching(&self, nodes: &[f64], level: f64) -> Vec<Vec<[f64; 2]>> {
        let grid = CurvedGrid {
            columns: self.shares.len(),
            values: nodes,
            places: &self.places,
        };
        contours(&grid, level)
    }
}

/// Returns values with one before and one after them.
fn between<T>(first: T, values: impl Iterator<Item = T>, last: T) -> Vec<T> {
    once(first).chain(values).chain(once(last)).collect()
}

/// Returns the bounding box `[x_min, x_max, y_min, y_max]` of points; `[∞, -∞, ∞, -∞]` without points.
pub(crate) fn bounds(points: impl Iterator<Item = [f64; 2]>) -> [f64; 4] {
    let none = [
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ];
    points.fold(none, |[left, right, low, high], [x, y]| {
        [left.min(x), right.max(x), low.min(y), high.max(y)]
    })
}

/// Returns Chebyshev positions from 0 to 1, which are denser at both ends, where the border is round and a field is steep.
fn chebyshev(of: usize) -> Vec<f64> {
    let count = (4 * of + 1).clamp(NODES[0], NODES[1]);
    let share = |k: usize| 0.5 * (1.0 - (PI * k as f64 / (count - 1) as f64).cos());
    (0..count).map(share).collect()
}

/// Values at the nodes of a curved grid, row by row.
struct CurvedGrid<'a> {
    /// Number of nodes of a row.
    columns: usize,
    /// The values of the nodes.
    values: &'a [f64],
    /// The positions of the nodes in mm.
    places: &'a [[f64; 2]],
}

impl CurvedGrid<'_> {
    /// Returns the value at a node of the grid extended by a ring of nodes at -∞.
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

    /// Returns the point where the level is crossed between two nodes, by linear interpolation; at the border of the grid its node.
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

/// An edge of the grid: its lower node, and whether it leads to the next row.
type GridEdge = (usize, usize, bool);

/// Returns closed curves with the part that reaches the level on their left (marching squares; W. E. Lorensen and H. E. Cline, 1987, in two
/// dimensions). If two parts meet in a square, the mean of its corners decides whether they are joined.
fn contours(grid: &CurvedGrid, level: f64) -> Vec<Vec<[f64; 2]>> {
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

/// Adds the pieces of curves in the square with this lower left node.
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
        // The curve leaves the square at the end of the part inside, and returns at its beginning.
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

/// Returns the area of a closed curve, positive if it runs counter-clockwise.
fn signed_area(points: &[[f64; 2]]) -> f64 {
    let following = points.iter().cycle().skip(1);
    let pairs = points.iter().zip(following);
    0.5 * pairs.map(|(a, b)| a[0] * b[1] - b[0] * a[1]).sum::<f64>()
}

impl Sheet {
    /// Returns closed curves around the stick zone in mm, counter-clockwise, holes clockwise; `None` if zones are not known.
    ///
    /// Along a strip, the border is where the margin to the traction bound vanishes. Its square, which is linear near the border in Carter's
    /// problem (1926), is extrapolated from the last two cells that stick, at most to the centre of the cell that slips. Without pressure or
    /// traction, the border is the edge between the cells. Between strips, a function that vanishes at the border is interpolated, which
    /// closes zones that end between strips. Pieces smaller than the largest cell are omitted.
    #[must_use]
    pub(crate) fn stick(
        &self,
        cells: &PatchCells,
        values: &PointFields,
    ) -> Option<Vec<Vec<[f64; 2]>>> {
        let zones = values.zone.as_deref()?;
        let margins = BoundMargins::of(cells, values);
        let strips: Vec<ZoneChanges> = self
            .strips
            .iter()
            .map(|strip| ZoneChanges::of(strip, cells, zones, margins.as_ref()))
            .collect();
        let sampled: Vec<Vec<f64>> = (0..strips.len())
            .map(|at| {
                let level = strips[at].lone_level(&strips, at);
                let shares = self.shares.iter();
                shares
                    .map(|share| strips[at].value(*share, level))
                    .collect()
            })
            .collect();
        let nodes = self.across(&sampled, AtBorder::Continues);
        let mut loops = self.reaching(&nodes, 0.0);
        let areas = cells.dx_mm.iter().zip(&cells.dy_mm).map(|(dx, dy)| dx * dy);
        let smallest = areas.fold(0.0, f64::max);
        loops.retain(|points| signed_area(points).abs() >= smallest);
        Some(loops)
    }
}

/// The values from which the margin to the traction bound follows.
struct BoundMargins<'a> {
    pressure: &'a [f64],
    along: &'a [f64],
    across: &'a [f64],
}

impl<'a> BoundMargins<'a> {
    fn of(cells: &'a PatchCells, values: &'a PointFields) -> Option<BoundMargins<'a>> {
        Some(BoundMargins {
            pressure: cells.pressure_mpa.as_deref()?,
            along: values.traction_x_mpa.as_deref()?,
            across: values.traction_y_mpa.as_deref()?,
        })
    }

    fn traction(&self, cell: usize) -> f64 {
        self.along[cell].hypot(self.across[cell])
    }

    /// Returns the x where the bound is reached between the cell `near`, which sticks, and `slipping`; `far` is the cell beyond `near`.
    fn reached(&self, x: &[f64], far: usize, near: usize, slipping: usize) -> Option<f64> {
        // A slipping cell reaches the bound, so that this is the local coefficient of friction, for any friction law.
        let friction = self.traction(slipping) / self.pressure[slipping];
        let square = |cell: usize| {
            let margin = friction * self.pressure[cell] - self.traction(cell);
            margin.max(0.0).powi(2)
        };
        let (inner, outer) = (square(far), square(near));
        let step = (x[near] - x[far]) * outer / (inner - outer);
        let place = x[near] + step;
        let (low, high) = (x[near].min(x[slipping]), x[near].max(x[slipping]));
        (inner > outer && place.is_finite()).then(|| place.clamp(low, high))
    }
}

/// The changes between stick and slip along a strip, as shares of its length.
struct ZoneChanges {
    places: Vec<f64>,
    /// Whether it sticks before the first change.
    sticks_first: bool,
}

impl ZoneChanges {
    fn of(
        strip: &StoredSegment,
        cells: &PatchCells,
        zones: &[Zone],
        margins: Option<&BoundMargins>,
    ) -> ZoneChanges {
        let sticks = |cell: usize| zones[cell] == Zone::Stick;
        let x = &cells.x_mm;
        let mut places: Vec<f64> = Vec::new();
        for cell in strip.cells.start + 1..strip.cells.end {
            if sticks(cell) == sticks(cell - 1) {
                continue;
            }
            let (near, slipping, far) = if sticks(cell) {
                (cell, cell - 1, Some(cell + 1))
            } else {
                (cell - 1, cell, cell.checked_sub(2))
            };
            let far = far.filter(|far| strip.cells.contains(far) && sticks(*far));
            let place = margins
                .zip(far)
                .and_then(|(m, far)| m.reached(x, far, near, slipping));
            let place = place.unwrap_or(x[cell] - 0.5 * cells.dx_mm[cell]);
            let share = (place - strip.left) / (strip.right - strip.left);
            places.push(share.max(places.last().copied().unwrap_or(0.0)));
        }
        ZoneChanges {
            places,
            sticks_first: sticks(strip.cells.start),
        }
    }

    /// Returns a function that is positive in stick, negative in slip, and a parabola between two changes. The squared width of a zone is then
    /// linear between strips, and its end is round. The outermost parts reach their largest value at the end of the strip.
    fn value(&self, share: f64, lone: f64) -> f64 {
        let passed = self.places.iter().filter(|place| **place <= share).count();
        let sign = if (passed % 2 == 0) == self.sticks_first {
            1.0
        } else {
            -1.0
        };
        let before = passed.checked_sub(1).map(|k| share - self.places[k]);
        let after = self.places.get(passed).map(|place| place - share);
        sign * match (before, after) {
            (Some(before), Some(after)) => before * after,
            (Some(before), None) => before * (2.0 * (1.0 - share) + before),
            (None, Some(after)) => after * (2.0 * share + after),
            (None, None) => lone,
        }
    }

    /// Returns the magnitude of the value of a strip without a change: the largest value of the opposite zone in adjacent strips, so that that zone
    /// ends half-way.
    fn lone_level(&self, strips: &[ZoneChanges], at: usize) -> f64 {
        let beside = [at.checked_sub(1), Some(at + 1)];
        let beside = beside.into_iter().flatten().filter_map(|k| strips.get(k));
        let sign = if self.sticks_first { -1.0 } else { 1.0 };
        let samples = beside
            .flat_map(|strip| (0..=32).map(move |k| sign * strip.value(f64::from(k) / 32.0, 0.0)));
        let largest = samples.fold(0.0, f64::max);
        if largest > 0.0 { largest } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::super::outlines::samples::{ellipse, push_segment};
    use super::*;

    #[test]
    fn eight_strips_show_an_ellipse_and_hertz_pressure_on_it() {
        let (a, b) = (3.0, 2.0);
        let cells = ellipse(a, b, 0.0, 8, 11);
        let sheet = Sheet::new(&cells).expect("one piece");
        for [x, y] in sheet.border() {
            let radius = (x / a).hypot(y / b);
            assert!((radius - 1.0).abs() < 0.02, "{x} {y}: {radius}");
        }
        let pressure = |[x, y]: [f64; 2]| (1.0 - (x / a).powi(2) - (y / b).powi(2)).max(0.0).sqrt();
        let places = cells.x_mm.iter().zip(&cells.y_mm);
        let values: Vec<f64> = places.map(|(x, y)| pressure([*x, *y])).collect();
        let nodes = sheet.nodes(&values, &cells, AtBorder::Vanishes);
        let largest = values.iter().copied().fold(0.0, f64::max);
        for (place, value) in sheet.places.iter().zip(&nodes) {
            assert!(*value <= largest + 1e-12, "no overshoot");
            assert!(
                (value.powi(2) - pressure(*place).powi(2)).abs() < 0.05,
                "{place:?} {value}"
            );
        }
        let half = sheet.reaching(&nodes, 0.75_f64.sqrt());
        assert_eq!(half.len(), 1);
        let area = PI * a * b / 4.0;
        assert!(
            (signed_area(&half[0]) / area - 1.0).abs() < 0.04,
            "{}",
            signed_area(&half[0])
        );
    }

    #[test]
    fn patches_with_gaps_or_too_few_strips_have_no_sheet() {
        assert!(Sheet::new(&ellipse(1.0, 1.0, 0.0, 2, 5)).is_none());
        let mut gap = ellipse(1.0, 1.0, 0.0, 5, 5);
        push_segment(&mut gap, 5, 1.2, 0.4, &[-0.5, -0.2]);
        push_segment(&mut gap, 5, 1.2, 0.4, &[0.2, 0.5]);
        assert!(Sheet::new(&gap).is_none());
    }
}

#[cfg(test)]
mod contour_tests {
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
        let expected = PI * 0.25;
        assert!((signed_area(&circle[0]) - expected).abs() < 5e-3);
        let cut = contours(&grid, -0.2);
        assert_eq!(cut.len(), 1, "the sides of the square close it");
        // A circle of radius 1.2 in a square of side 2.
        let round = 4.0 * 0.44_f64.sqrt() + 1.44 * (PI - 4.0 * (1.0_f64 / 1.2).acos());
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

#[cfg(test)]
mod stick_tests {
    use super::super::outlines::samples::ellipse;
    use super::*;

    /// Carter's tractions along every strip of an ellipse: sticks where the second root is not 0.
    fn carter(cells: &PatchCells, a: f64, b: f64, shrink: f64) -> (PatchCells, PointFields) {
        let mut cells = cells.clone();
        let (mut pressure, mut traction, mut zone) = (Vec::new(), Vec::new(), Vec::new());
        for (x, y) in cells.x_mm.iter().zip(&cells.y_mm) {
            let chord = a * (1.0 - (y / b).powi(2)).sqrt();
            let root = |half: f64, x: f64| (half * half - x * x).max(0.0).sqrt();
            let inner = (chord - shrink).max(0.0);
            let lost = root(inner, x - (chord - inner));
            pressure.push(root(chord, *x));
            traction.push(0.3 * (root(chord, *x) - lost));
            zone.push(if lost > 0.0 { Zone::Stick } else { Zone::Slip });
        }
        cells.pressure_mpa = Some(pressure);
        let across = vec![0.0; traction.len()];
        let values = PointFields {
            zone: Some(zone),
            traction_x_mpa: Some(traction),
            traction_y_mpa: Some(across),
            ..PointFields::default()
        };
        (cells, values)
    }

    #[test]
    fn border_of_carters_stick_zone_is_found_within_a_cell() {
        let (a, b, shrink) = (4.0, 3.0, 1.2);
        let (cells, values) = carter(&ellipse(a, b, 0.0, 8, 11), a, b, shrink);
        let sheet = Sheet::new(&cells).expect("one piece");
        let loops = sheet.stick(&cells, &values).expect("zones are known");
        assert_eq!(loops.len(), 1, "one zone, no stray cells");
        // The trailing end of the zone at y is at chord − 2 (chord − shrink).
        let trailing = loops[0].iter().filter(|[_, y]| y.abs() < 1.6);
        for [x, y] in trailing {
            let chord = a * (1.0 - (y / b).powi(2)).sqrt();
            let border = 2.0 * shrink - chord;
            if *x < chord - 0.5 {
                // The cells there are 1.1 mm long.
                assert!((x - border).abs() < 0.3, "at y = {y}: {x}, not {border}");
            }
        }
        let [left, right, low, high] = sheet.extent();
        for [x, y] in loops.iter().flatten() {
            assert!(*x >= left && *x <= right && *y >= low && *y <= high);
        }
    }

    #[test]
    fn a_single_cell_in_the_other_zone_is_no_zone() {
        let (a, b) = (4.0, 3.0);
        let (cells, mut values) = carter(&ellipse(a, b, 0.0, 9, 20), a, b, 9.0);
        let sheet = Sheet::new(&cells).expect("one piece");
        assert_eq!(
            sheet.stick(&cells, &values),
            Some(Vec::new()),
            "it slips everywhere"
        );
        if let Some(zones) = values.zone.as_mut() {
            zones[95] = Zone::Stick;
        }
        assert_eq!(sheet.stick(&cells, &values), Some(Vec::new()));
    }
}
