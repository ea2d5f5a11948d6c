//! Interpolates cell values onto a regular grid, for pictures and for programs that read arrays.

use super::outlines::{Continuation, StoredSegment, Strips};
use railhead_contact::solution::words::answer::{PatchCells, Zone};

/// Values on a regular grid; `None` outside the patch.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Gridded<T = f64> {
    /// Sample points along x in mm, ascending.
    pub(crate) x_mm: Vec<f64>,
    /// Sample points along y in mm, ascending.
    pub(crate) y_mm: Vec<f64>,
    /// `values[iy][ix]` at `(x_mm[ix], y_mm[iy])`.
    pub(crate) values: Vec<Vec<Option<T>>>,
}

/// Interpolates cell values on `nx × ny` points over the bounding box of the patch.
///
/// The points are the centres of `nx × ny` equal rectangles that fill the box, so that the sum of all values times the area of a rectangle
/// approximates the integral, with a first-order error at the border of the patch.
///
/// Along a strip, values are linear between the centres of cells, and constant beyond the first and last centre. Between the mid-lines of
/// two strips, the ends of the chord are linear in y, and so are values at equal relative positions in both chords. Beyond the first and
/// last mid-line the chord is extrapolated as in [`patch_outline`](super::outlines::patch_outline). If segments branch, every segment
/// continues unchanged to the borders of its strip. Constants are reproduced everywhere, linear fields between the outermost centres of a
/// chord and between the outermost mid-lines.
///
/// # Panics
/// If `nx` or `ny` is less than 2, or the number of `values` differs from that of the cells.
#[must_use]
pub(crate) fn resample(fields: &PatchCells, values: &[f64], nx: usize, ny: usize) -> Gridded {
    assert_eq!(
        values.len(),
        fields.x_mm.len(),
        "there must be one value per cell"
    );
    sample(fields, nx, ny, |sample| {
        let near = along(fields, values, &sample.near);
        sample.far.as_ref().map_or(near, |far| {
            near + sample.weight * (along(fields, values, far) - near)
        })
    })
}

/// Returns the zone of the nearest cell on `nx × ny` points over the bounding box of the patch.
///
/// Points and patch are those of [`resample`]. The cell is that at the same relative position in the nearest strip.
///
/// # Panics
/// If `nx` or `ny` is less than 2, or the number of `zones` differs from that of the cells.
#[must_use]
pub(crate) fn resample_zone(
    fields: &PatchCells,
    zones: &[Zone],
    nx: usize,
    ny: usize,
) -> Gridded<Zone> {
    assert_eq!(
        zones.len(),
        fields.x_mm.len(),
        "there must be one zone per cell"
    );
    sample(fields, nx, ny, |sample| {
        let cells = &sample.near.cells;
        let beyond = |i: &usize| fields.x_mm[*i] + 0.5 * fields.dx_mm[*i] < sample.near.x;
        let inside = cells.clone().find(|i| !beyond(i)).unwrap_or(cells.end - 1);
        zones[inside]
    })
}

/// A point in a segment: the cells of the segment, and x in mm.
struct CellPosition {
    cells: std::ops::Range<usize>,
    x: f64,
}

/// A sample point inside the patch.
struct SamplePoint {
    /// The point in the nearest strip.
    near: CellPosition,
    /// The point at the same relative position in the adjacent strip, if the segment continues there.
    far: Option<CellPosition>,
    /// Weight of `far`, 0 to ½.
    weight: f64,
}

fn sample<T>(
    fields: &PatchCells,
    nx: usize,
    ny: usize,
    value: impl Fn(&SamplePoint) -> T,
) -> Gridded<T> {
    assert!(
        nx >= 2 && ny >= 2,
        "a grid needs at least two points along each axis"
    );
    let strips = Strips::new(fields);
    if strips.segments.is_empty() {
        return Gridded {
            x_mm: Vec::new(),
            y_mm: Vec::new(),
            values: Vec::new(),
        };
    }
    let low =
        |f: fn(&StoredSegment) -> f64| strips.segments.iter().map(f).fold(f64::INFINITY, f64::min);
    let (x0, x1) = (low(|s| s.left), -low(|s| -s.right));
    let (y0, y1) = (low(|s| s.y - 0.5 * s.dy), -low(|s| -(s.y + 0.5 * s.dy)));
    let x_mm = centres(x0, x1, nx);
    let y_mm = centres(y0, y1, ny);
    let values = y_mm
        .iter()
        .map(|&y| {
            let row = chords(&strips, y);
            x_mm.iter()
                .map(|&x| {
                    row.iter()
                        .find_map(|chord| chord.sample(&strips, x))
                        .map(|sample| value(&sample))
                })
                .collect()
        })
        .collect();
    Gridded { x_mm, y_mm, values }
}

/// Returns the centres of `n` equal parts of an interval.
fn centres(from: f64, to: f64, n: usize) -> Vec<f64> {
    let step = (to - from) / n as f64;
    (0..n).map(|k| from + (k as f64 + 0.5) * step).collect()
}

/// The intersection of a line of constant y with a segment.
struct ChordCut {
    near: usize,
    far: Option<usize>,
    weight: f64,
    left: f64,
    right: f64,
}

impl ChordCut {
    fn sample(&self, strips: &Strips, x: f64) -> Option<SamplePoint> {
        if x < self.left || x > self.right {
            return None;
        }
        let part = if self.right > self.left {
            (x - self.left) / (self.right - self.left)
        } else {
            0.5
        };
        let place = |k: usize| {
            let segment = &strips.segments[k];
            CellPosition {
                cells: segment.cells.clone(),
                x: segment.left + part * (segment.right - segment.left),
            }
        };
        Some(SamplePoint {
            near: place(self.near),
            far: self.far.map(place),
            weight: self.weight,
        })
    }
}

/// Returns the intersections of the line at `y` with the patch.
fn chords(strips: &Strips, y: f64) -> Vec<ChordCut> {
    let covers = |strip: &&std::ops::Range<usize>| {
        let first = &strips.segments[strip.start];
        (y - first.y).abs() <= 0.5 * first.dy * (1.0 + 1e-9)
    };
    let Some(strip) = strips.strips.iter().find(covers) else {
        return Vec::new();
    };
    strip
        .clone()
        .map(|near| {
            let segment = &strips.segments[near];
            let side = usize::from(y >= segment.y);
            let (far, [end_y, end_left, end_right]) = match segment.next[side] {
                Continuation::Segment(far) => {
                    let next = &strips.segments[far];
                    (Some(far), [next.y, next.left, next.right])
                }
                _ => {
                    let (left, right) = strips.tip(near, side == 1);
                    let border = segment.y + [-0.5, 0.5][side] * segment.dy;
                    (None, [border, left, right])
                }
            };
            let weight = (y - segment.y) / (end_y - segment.y);
            let left = segment.left + weight * (end_left - segment.left);
            let right = segment.right + weight * (end_right - segment.right);
            ChordCut {
                near,
                far,
                weight,
                left,
                right,
            }
        })
        .collect()
}

/// Returns the value of a segment at a point: linear between centres, constant beyond the outermost ones.
fn along(fields: &PatchCells, values: &[f64], place: &CellPosition) -> f64 {
    let cells = place.cells.clone();
    let after =
        cells.start + fields.x_mm[cells.clone()].partition_point(|&centre| centre <= place.x);
    if after == cells.start {
        return values[after];
    }
    if after == cells.end {
        return values[after - 1];
    }
    let (x0, x1) = (fields.x_mm[after - 1], fields.x_mm[after]);
    let weight = (place.x - x0) / (x1 - x0);
    values[after - 1] + weight * (values[after] - values[after - 1])
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::outlines::samples::{ellipse, push_segment};
    use super::*;

    const A: f64 = 2.0;
    const B: f64 = 3.0;

    fn cell_area(grid: &Gridded, nx: usize, ny: usize) -> f64 {
        assert_eq!((grid.x_mm.len(), grid.y_mm.len()), (nx, ny));
        (grid.x_mm[1] - grid.x_mm[0]) * (grid.y_mm[1] - grid.y_mm[0])
    }

    #[test]
    fn constants_are_reproduced_and_nothing_lies_outside() {
        let fields = ellipse(A, B, 0.0, 20, 20);
        let grid = resample(&fields, &vec![7.0; 400], 61, 41);
        assert_eq!(grid.values.len(), 41);
        let mut inside = 0;
        for (row, &y) in grid.values.iter().zip(&grid.y_mm) {
            assert_eq!(row.len(), 61);
            for (value, &x) in row.iter().zip(&grid.x_mm) {
                let level = (x / A).powi(2) + (y / B).powi(2);
                inside += usize::from(value.is_some());
                assert!(value.is_none_or(|v| (v - 7.0).abs() < 1e-14));
                assert!(
                    value.is_none() || level <= 1.0 + 1e-9,
                    "({x}, {y}) is outside the ellipse"
                );
                assert!(
                    value.is_some() || level > 0.96,
                    "({x}, {y}) is inside the ellipse"
                );
            }
        }
        assert!(inside > 1900);
        assert!(grid.x_mm.is_sorted() && grid.y_mm.is_sorted());
    }

    #[test]
    fn linear_fields_are_reproduced_inside() {
        let fields = ellipse(A, B, 0.3, 20, 16);
        let plane = |x: f64, y: f64| 2.0 - 0.7 * x + 1.3 * y;
        let values: Vec<f64> = fields
            .x_mm
            .iter()
            .zip(&fields.y_mm)
            .map(|(&x, &y)| plane(x, y))
            .collect();
        let grid = resample(&fields, &values, 50, 50);
        let mut checked = 0;
        for (row, &y) in grid.values.iter().zip(&grid.y_mm) {
            for (value, &x) in row.iter().zip(&grid.x_mm) {
                // The bound 0.96 excludes the half cells at the ends of every chord, where values are constant.
                if y.abs() < 0.9 * B && ((x - 0.3 * y) / A).powi(2) + (y / B).powi(2) < 0.96 {
                    let value = value.unwrap();
                    assert!(
                        (value - plane(x, y)).abs() < 1e-12,
                        "at ({x}, {y}): {value}"
                    );
                    checked += 1;
                }
            }
        }
        assert!(checked > 1000);
    }

    #[test]
    fn sum_times_cell_area_approximates_the_integral() {
        let error = |n: usize| {
            let fields = ellipse(A, B, 0.0, n as u32, n as u32);
            let hertz = |x: f64, y: f64| (1.0 - (x / A).powi(2) - (y / B).powi(2)).max(0.0).sqrt();
            let values: Vec<f64> = fields
                .x_mm
                .iter()
                .zip(&fields.y_mm)
                .map(|(&x, &y)| hertz(x, y))
                .collect();
            let grid = resample(&fields, &values, 4 * n, 4 * n);
            let sum: f64 = grid.values.iter().flatten().flatten().sum();
            (sum * cell_area(&grid, 4 * n, 4 * n) / (2.0 / 3.0 * PI * A * B) - 1.0).abs()
        };
        assert!(error(16) < 0.015, "{}", error(16));
        assert!(error(64) < error(16) / 4.0, "{} {}", error(16), error(64));
    }

    #[test]
    fn segments_that_branch_are_not_blended_across_the_gap() {
        let mut fields = PatchCells::default();
        push_segment(&mut fields, 0, 0.5, 1.0, &[0.0, 1.0, 2.0, 3.0]);
        push_segment(&mut fields, 1, 1.5, 1.0, &[0.0, 1.0]);
        push_segment(&mut fields, 1, 1.5, 1.0, &[2.0, 3.0]);
        let grid = resample(&fields, &[1.0, 1.0, 1.0, 5.0, 9.0], 3, 4);
        assert_eq!(grid.y_mm, vec![0.25, 0.75, 1.25, 1.75]);
        assert_eq!(grid.values[0], vec![Some(1.0); 3]);
        assert_eq!(grid.values[1], vec![Some(1.0); 3]);
        assert_eq!(grid.values[2], vec![Some(5.0), None, Some(9.0)]);
        assert_eq!(grid.values[3], vec![Some(5.0), None, Some(9.0)]);
    }

    #[test]
    fn zones_come_from_the_nearest_cell() {
        let fields = ellipse(A, B, 0.0, 12, 12);
        let zones: Vec<Zone> = fields
            .x_mm
            .iter()
            .map(|&x| if x > 0.0 { Zone::Stick } else { Zone::Slip })
            .collect();
        let grid = resample_zone(&fields, &zones, 40, 30);
        let mut seen = [0, 0];
        for row in &grid.values {
            for (zone, &x) in row.iter().zip(&grid.x_mm) {
                if let Some(zone) = zone {
                    assert_eq!(*zone, if x > 0.0 { Zone::Stick } else { Zone::Slip });
                    seen[usize::from(*zone == Zone::Stick)] += 1;
                }
            }
        }
        assert_eq!(seen[0], seen[1]);
        let blend = resample(&fields, &vec![1.0; 144], 40, 30);
        for (a, b) in grid
            .values
            .iter()
            .flatten()
            .zip(blend.values.iter().flatten())
        {
            assert_eq!(a.is_some(), b.is_some());
        }
    }

    #[test]
    fn strips_apart_leave_their_gap_empty() {
        let mut fields = PatchCells::default();
        push_segment(&mut fields, 0, 0.5, 1.0, &[0.0, 1.0]);
        push_segment(&mut fields, 2, 2.5, 1.0, &[0.0, 1.0]);
        let grid = resample(&fields, &[1.0, 2.0], 2, 3);
        assert_eq!(
            grid.values,
            vec![vec![Some(1.0); 2], vec![None; 2], vec![Some(2.0); 2]]
        );
    }
}
