//! A patch of one piece as a curved grid that ends at its border, and fields on it.
//!
//! A node stands at a share of the chord at its height, so that what follows the border stays smooth beside it.

use std::f64::consts::PI;

use crate::contact::numerics::hermite::monotone;
use crate::contact::post::smooth::contour::{CurvedGrid, contours};
use crate::contact::post::strip_segments::Strips;
use crate::contact::solution::words::fields::PatchCells;

/// SheetNodes of the grid along one axis, at least and at most; between them four per cell or strip.
const NODES: [usize; 2] = [65, 257];
/// Strips from which on something can be interpolated between them.
const STRIPS_MIN: usize = 3;

/// What a field does at the border of the patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AtBorder {
    /// It vanishes like the square root of the distance: pressure, and what friction bounds.
    Vanishes,
    /// It goes on as in the outermost cells.
    Continues,
}

/// One strip: its cells and where it lies.
#[derive(Debug, Clone)]
pub(crate) struct SheetStrip {
    pub(crate) cells: std::ops::Range<usize>,
    pub(crate) left: f64,
    pub(crate) right: f64,
}

/// A curved grid over a patch.
#[derive(Debug, Clone)]
pub struct Sheet {
    pub(crate) strips: Vec<SheetStrip>,
    /// Heights of the strips, between those of the lowest and the highest point of the border.
    heights: Vec<f64>,
    /// Shares of the chord at which nodes stand, from 0 to 1.
    pub(crate) shares: Vec<f64>,
    /// Heights of the rows.
    rows: Vec<f64>,
    places: Vec<[f64; 2]>,
}

/// A field at the nodes of a [`Sheet`].
#[derive(Debug, Clone, PartialEq)]
pub struct SheetNodes(pub(crate) Vec<f64>);

impl Sheet {
    /// The grid over a patch; `None` where it has fewer than three strips, or gaps.
    ///
    /// Between the middles of strips the chord's squared half-length and its centre are monotone cubics, so that the border of an
    /// ellipse is round at few strips too; its ends are those of [`patch_outline`](crate::contact::post::outlines::outline::patch_outline).
    #[must_use]
    pub fn new(cells: &PatchCells) -> Option<Sheet> {
        let found = Strips::new(cells);
        if !found.is_simple() || found.segments.len() < STRIPS_MIN {
            return None;
        }
        let segments = &found.segments;
        let last = segments.len() - 1;
        let heights: Vec<f64> = std::iter::once(segments[0].y - 0.5 * segments[0].dy)
            .chain(segments.iter().map(|segment| segment.y))
            .chain([segments[last].y + 0.5 * segments[last].dy])
            .collect();
        let ends: Vec<(f64, f64)> = std::iter::once(found.tip(0, false))
            .chain(segments.iter().map(|segment| (segment.left, segment.right)))
            .chain([found.tip(last, true)])
            .collect();
        let longest = segments.iter().map(|s| s.cells.len()).max().unwrap_or(0);
        let shares = crowded(longest);
        let (from, to) = (heights[0], heights[heights.len() - 1]);
        let rows: Vec<f64> = crowded(segments.len())
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
        let strips = segments.iter().map(|segment| SheetStrip {
            cells: segment.cells.clone(),
            left: segment.left,
            right: segment.right,
        });
        Some(Sheet {
            strips: strips.collect(),
            heights,
            shares,
            rows,
            places,
        })
    }

    /// The border of the patch in mm, counter-clockwise.
    #[must_use]
    pub fn border(&self) -> Vec<[f64; 2]> {
        let columns = self.shares.len();
        let leading = (0..self.rows.len()).map(|row| self.places[(row + 1) * columns - 1]);
        let trailing = (0..self.rows.len())
            .rev()
            .map(|row| self.places[row * columns]);
        leading.chain(trailing).collect()
    }

    /// Box around the border: x from, x to, y from, y to in mm.
    #[must_use]
    pub fn extent(&self) -> [f64; 4] {
        let mut shape = [
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::INFINITY,
            f64::NEG_INFINITY,
        ];
        for [x, y] in &self.places {
            shape = [
                shape[0].min(*x),
                shape[1].max(*x),
                shape[2].min(*y),
                shape[3].max(*y),
            ];
        }
        shape
    }

    /// Values of cells at the nodes: monotone cubics along every strip and from strip to strip at equal shares of their lengths.
    /// Nothing exceeds the values of the cells. What vanishes at the border is squared before and its root taken after, which is
    /// exact for Hertz's pressure.
    ///
    /// # Panics
    /// If there are fewer values than cells.
    #[must_use]
    pub fn nodes(&self, values: &[f64], cells: &PatchCells, edge: AtBorder) -> SheetNodes {
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
            let knots: Vec<f64> = std::iter::once(0.0)
                .chain(inside.clone().map(share))
                .chain([1.0])
                .collect();
            let heights: Vec<f64> = std::iter::once(of_end(inside.start))
                .chain(inside.clone().map(power))
                .chain([of_end(inside.end - 1)])
                .collect();
            monotone(&knots, &heights, &self.shares)
        });
        let strips: Vec<Vec<f64>> = strips.collect();
        let SheetNodes(mut nodes) = self.across(&strips, edge);
        if edge == AtBorder::Vanishes {
            nodes
                .iter_mut()
                .for_each(|value| *value = value.max(0.0).sqrt());
        }
        SheetNodes(nodes)
    }

    /// Interpolates across what is known along every strip at the shares of the nodes.
    pub(crate) fn across(&self, strips: &[Vec<f64>], edge: AtBorder) -> SheetNodes {
        let (columns, last) = (self.shares.len(), strips.len() - 1);
        let mut nodes = vec![0.0; columns * self.rows.len()];
        for column in 0..columns {
            let outer = |strip: usize| match edge {
                AtBorder::Vanishes => 0.0,
                AtBorder::Continues => strips[strip][column],
            };
            let knots: Vec<f64> = std::iter::once(outer(0))
                .chain(strips.iter().map(|strip| strip[column]))
                .chain([outer(last)])
                .collect();
            let along = monotone(&self.heights, &knots, &self.rows);
            for (row, value) in along.into_iter().enumerate() {
                nodes[row * columns + column] = value;
            }
        }
        SheetNodes(nodes)
    }

    /// Closed curves around where a field reaches a level, counter-clockwise, holes clockwise; they end at the border of the patch.
    #[must_use]
    pub fn reaching(&self, nodes: &SheetNodes, level: f64) -> Vec<Vec<[f64; 2]>> {
        let grid = CurvedGrid {
            columns: self.shares.len(),
            values: &nodes.0,
            places: &self.places,
        };
        contours(&grid, level)
    }
}

/// Shares from 0 to 1, closer to each other at both ends, where a border is round and a field steep.
fn crowded(of: usize) -> Vec<f64> {
    let count = (4 * of + 1).clamp(NODES[0], NODES[1]);
    #[expect(clippy::cast_precision_loss, reason = "a few hundred")]
    let share = |k: usize| 0.5 * (1.0 - (PI * k as f64 / (count - 1) as f64).cos());
    (0..count).map(share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::post::smooth::contour::signed_area;
    use crate::contact::post::strip_segments::samples::{ellipse, push_segment};

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
        for (place, value) in sheet.places.iter().zip(&nodes.0) {
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
