//! Grids of equal rectangles over the contact plane, their refinement criteria, and the types of a solution of a gap.
//!
//! Errors with the constants below are those of `tests/physics/gap_hertz.rs` and `gap_reference.rs`; `cargo bench --bench report` shows times and
//! errors of the reference gaps.

use std::f64::consts::PI;

use crate::monitor::Stop;
use crate::normal::gap::conjugate_gradients;
use crate::normal::gap::conjugate_gradients::PressureAnswer;
use crate::normal::gap::surface::{GapSurface, Window};
use crate::normal::pressure_field::field::PressureField;
use crate::numerics::flood_fill::groups;
use crate::remark::entry::RemarkEntry;

/// Largest number of cells along an axis.
const CELLS_MAX: usize = 200;
/// Part of its length by which a box grows that is too small. 0.12 and 0.5 give the same results with as many iterations on the 100 gaps of
/// `cargo bench --bench calibrate gap`, whose boxes are large enough.
const GROWTH: f64 = 0.25;

/// Largest length of a cell over the half-width of its patch along the other axis. On 80 random rollers with crowned ends the error of the resultants due to the
/// grid is 0.001 in the median at 0.2 to 0.4, and 0.01 at 0.8 to 2.
const STEP_OF_HALF_WIDTH: f64 = 0.4;

/// The cells of a box. Cell (i, j) is stored at `j * cells[0] + i`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PressureGrid {
    /// Middle of the box in mm.
    pub(crate) middle: [f64; 2],
    /// Size of a cell in mm.
    pub(crate) step: [f64; 2],
    /// Number of cells along x and y.
    pub(crate) cells: [usize; 2],
    /// Whether the gap, and the grid with it, is mirror-symmetric about x = 0 and about y = 0.
    pub(crate) mirrored: [bool; 2],
}

/// One of the four sides of a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct GridSide {
    axis: usize,
    /// Whether the side is that of the larger coordinate.
    upper: bool,
}

/// Place and resolution of the next grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NextGrid {
    pub(crate) window: Window,
    pub(crate) cells: [usize; 2],
    /// Numbers of cells along each axis that would resolve the contact.
    pub(crate) needed: [usize; 2],
    /// Whether more cells are needed than a grid may have, so that a patch will be too coarse.
    pub(crate) capped: bool,
}

/// Required number of cells across the contact, and when a grid is good enough.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GridFineness {
    /// Cells across the whole contact.
    pub(crate) contact: f64,
    /// Whether the result is compared with that of the previous grid.
    pub(crate) settles: bool,
    /// Violation of the contact conditions, relative to the deepest overlap, that ends the iteration on all grids but the first.
    pub(crate) tolerance: f64,
}

impl GridSide {
    /// The name of the side, with its coordinate in the limits of the data.
    pub(crate) fn place(self, limits: Window) -> String {
        let name = ["x", "y"][self.axis];
        format!("{name} = {} mm", limits[self.axis][usize::from(self.upper)])
    }
}

impl PressureGrid {
    /// A grid over a window, with 4 to 200 cells along either axis, which is symmetric about x = 0 and y = 0 where `mirrored`.
    pub(crate) fn new(window: Window, cells: [usize; 2], mirrored: [bool; 2]) -> PressureGrid {
        let cells = cells.map(|n| n.clamp(4, CELLS_MAX));
        let mut middle = window.map(|[low, high]| 0.5 * (low + high));
        let mut length = window.map(|[low, high]| high - low);
        for k in (0..2).filter(|k| mirrored[*k]) {
            let [low, high] = window[k];
            (middle[k], length[k]) = (0.0, 2.0 * high.max(-low));
        }
        PressureGrid {
            middle,
            step: [0, 1].map(|k| length[k] / cells[k] as f64),
            cells,
            mirrored,
        }
    }

    /// Coordinates of the centres along an axis.
    pub(crate) fn centres(&self, axis: usize) -> Vec<f64> {
        let n = self.cells[axis] as f64;
        // This form gives exact mirror images for a middle of 0.
        (0..self.cells[axis])
            .map(|i| self.middle[axis] + (i as f64 + 0.5 - 0.5 * n) * self.step[axis])
            .collect()
    }

    /// The ends of the box along an axis.
    pub(crate) fn range(&self, axis: usize) -> [f64; 2] {
        let half = 0.5 * self.cells[axis] as f64 * self.step[axis];
        [self.middle[axis] - half, self.middle[axis] + half]
    }

    /// Whether a place lies in the box.
    pub(crate) fn holds(&self, place: [f64; 2]) -> bool {
        (0..2).all(|k| {
            let [low, high] = self.range(k);
            (low..high).contains(&place[k])
        })
    }

    /// The gap at the centres.
    pub(crate) fn gap(&self, gap: &GapSurface) -> Vec<f64> {
        let mut values = gap.on(&self.centres(0), &self.centres(1));
        for [image, cell] in self.images() {
            values[image] = values[cell];
        }
        values
    }

    /// Replaces a value and its mirror image by their mean.
    pub(crate) fn symmetrise(&self, values: &mut [f64]) {
        for [image, cell] in self.images() {
            let mean = 0.5 * (values[image] + values[cell]);
            (values[image], values[cell]) = (mean, mean);
        }
    }

    /// Pairs of cells and their mirror images, first about x = 0, then about y = 0.
    fn images(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let ([width, rows], [along, across]) = (self.cells, self.mirrored);
        let half = if along { width / 2 } else { 0 };
        let about_x = (0..rows)
            .flat_map(move |j| (0..half).map(move |i| [j * width + width - 1 - i, j * width + i]));
        let half = if across { rows / 2 } else { 0 };
        let about_y = (0..half).flat_map(move |j| {
            (0..width).map(move |i| [(rows - 1 - j) * width + i, j * width + i])
        });
        about_x.chain(about_y)
    }

    /// Interpolates pressures of another grid. Their squares, which fall linearly to 0 at the edge and are continued beyond it, are interpolated bilinearly. If all
    /// results are 0, the deepest cell gets the largest pressure.
    pub(crate) fn interpolate(
        &self,
        other: &PressureGrid,
        pressure: &[f64],
        gap: &[f64],
    ) -> Vec<f64> {
        let squares = continued(other.cells[0], squares(other.cells[0], pressure));
        let places = [0, 1].map(|axis| {
            let first = other.range(axis)[0] + 0.5 * other.step[axis];
            let at = move |x: f64| (x - first) / other.step[axis];
            self.centres(axis).into_iter().map(at).collect::<Vec<f64>>()
        });
        let width = other.cells[0];
        let mut out = bilinear(&places, width, |j| {
            squares.get(usize::try_from(j).ok()? * width..)
        });
        out.iter_mut().for_each(|p| *p = p.max(0.0).sqrt());
        if out.iter().all(|p| *p == 0.0) {
            let deepest = (0..gap.len()).min_by(|a, b| gap[*a].total_cmp(&gap[*b]));
            out[deepest.unwrap_or(0)] = pressure.iter().copied().fold(0.0, f64::max);
        }
        out
    }

    /// Sides whose outermost cells are in contact.
    pub(crate) fn sides_in_contact(&self, pressure: &[f64]) -> Vec<GridSide> {
        let [nx, ny] = self.cells;
        let touches = |side: &GridSide| {
            let [count, stride, across] = if side.axis == 0 {
                [ny, nx, 1]
            } else {
                [nx, 1, nx]
            };
            let first = (self.cells[side.axis] - 1) * usize::from(side.upper) * across;
            (0..count).any(|k| pressure[first + k * stride] > 0.0)
        };
        let all = [(0, false), (0, true), (1, false), (1, true)];
        let sides = all.map(|(axis, upper)| GridSide { axis, upper });
        sides.into_iter().filter(touches).collect()
    }

    /// Whether a side lies at the limit of the data.
    pub(crate) fn ends_at(&self, side: GridSide, limits: Window) -> bool {
        let end = usize::from(side.upper);
        (self.range(side.axis)[end] - limits[side.axis][end]).abs() < 0.5 * self.step[side.axis]
    }

    /// A grid that reaches farther on some sides, with cells of about the same size.
    pub(crate) fn enlarged(&self, sides: &[GridSide], limits: Window) -> PressureGrid {
        let mut window = [self.range(0), self.range(1)];
        for side in sides {
            let end = usize::from(side.upper);
            let growth = GROWTH * self.cells[side.axis] as f64 * self.step[side.axis];
            window[side.axis][end] += if side.upper { growth } else { -growth };
        }
        let window = within(window, limits);
        let cells = [0, 1].map(|k| {
            let [low, high] = window[k];
            ((high - low) / self.step[k]).round() as usize
        });
        PressureGrid::new(window, cells, self.mirrored)
    }

    /// The box around all cells that touch or are closer than `near`, and the cells that resolve its contents.
    pub(crate) fn wanted(
        &self,
        pressed: &PressureAnswer,
        near: f64,
        resolution: GridFineness,
        limits: Window,
    ) -> NextGrid {
        let mut whole = Extent::default();
        for (j, row) in pressed.distance.chunks_exact(self.cells[0]).enumerate() {
            let is_near = |distance: &f64| *distance < near;
            if let Some(first) = row.iter().position(is_near) {
                whole.add([first, j]);
                whole.add([row.iter().rposition(is_near).unwrap_or(first), j]);
            }
        }
        let mut contact = Extent::default();
        let total: f64 = pressed.pressure.iter().sum();
        let mut steps = [f64::INFINITY; 2];
        let patches = self.patches(&pressed.pressure);
        for patch in &patches {
            contact.join(self.extent(patch));
            let load: f64 = patch.iter().map(|k| pressed.pressure[*k]).sum();
            if load >= SHARE_MIN * total {
                let wanted = resolution.across(load / total);
                let wanted = wanted.max(resolution.resolving());
                let chords = self.chords_of(patch);
                for (k, step) in steps.iter_mut().enumerate() {
                    // The pressure at an end of a slender patch changes over its half-width.
                    let half_width = 0.5 * chords[1 - k] * self.step[1 - k];
                    let resolved = chords[k] * self.step[k] / wanted;
                    *step = step.min(resolved).min(STEP_OF_HALF_WIDTH * half_width);
                }
            }
        }
        let window = [0, 1].map(|k| {
            let length = contact.length(k) * self.step[k];
            steps[k] = steps[k].min(length / resolution.contact);
            let margin = (0.3 * self.step[k]).max(1.5 * steps[k]);
            let low = self.range(k)[0];
            let [first, last] = whole.0[k].map(|i| i as f64);
            [
                low + first * self.step[k] - margin,
                low + (last + 1.0) * self.step[k] + margin,
            ]
        });
        let window = within(window, limits);
        let needed = [0, 1].map(|k| ((window[k][1] - window[k][0]) / steps[k]).ceil() as usize);
        NextGrid {
            window,
            cells: needed.map(|cells| cells.clamp(4, CELLS_MAX)),
            needed,
            capped: needed.iter().any(|cells| *cells > CELLS_MAX),
        }
    }

    /// Lengths in cells of the chords along both axes through the middle of some cells.
    ///
    /// The chords of an ellipse oblique to the axes are those of the box around it times √(1 − ρ²), where ρ is the correlation of the coordinates of its points.
    pub(crate) fn chords_of(&self, cells: &[usize]) -> [f64; 2] {
        let extent = self.extent(cells);
        let mut sums = [0.0; 5];
        for cell in cells {
            let [x, y] = [cell % self.cells[0], cell / self.cells[0]].map(|i| i as f64);
            for (sum, part) in sums.iter_mut().zip([x, y, x * x, y * y, x * y]) {
                *sum += part;
            }
        }
        let [x, y, xx, yy, xy] = sums.map(|sum| sum / cells.len() as f64);
        // A cell has a variance of its own, so that a single line of cells has a width.
        let [along, across] = [xx - x * x, yy - y * y].map(|variance| variance + 1.0 / 12.0);
        let oblique = (1.0 - (xy - x * y).powi(2) / (along * across)).sqrt();
        [0, 1].map(|k| oblique * extent.length(k))
    }

    /// The box of some cells in mm.
    pub(crate) fn window_of(&self, cells: &[usize]) -> Window {
        let Extent(ranges) = self.extent(cells);
        [0, 1].map(|k| {
            let [first, last] = ranges[k].map(|i| i as f64);
            [first, last + 1.0].map(|i| self.range(k)[0] + i * self.step[k])
        })
    }

    /// The range of some cells in ascending order.
    fn extent(&self, cells: &[usize]) -> Extent {
        let width = self.cells[0];
        let mut extent = Extent::default();
        let (mut j, mut first) = (0, 0);
        for k in cells {
            while *k >= first + width {
                (j, first) = (j + 1, first + width);
            }
            extent.add([k - first, j]);
        }
        extent
    }

    /// Cells in contact, patch by patch. Cells are connected over edges and corners.
    pub(crate) fn patches(&self, pressure: &[f64]) -> Vec<Vec<usize>> {
        groups(self.cells, |cell| pressure[cell] > 0.0)
    }
}

/// First and last cell along both axes.
#[derive(Debug, Clone, Copy)]
struct Extent([[usize; 2]; 2]);

impl Default for Extent {
    fn default() -> Extent {
        Extent([[usize::MAX, 0]; 2])
    }
}

impl Extent {
    fn add(&mut self, cell: [usize; 2]) {
        for (range, i) in self.0.iter_mut().zip(cell) {
            *range = [range[0].min(i), range[1].max(i)];
        }
    }

    fn join(&mut self, other: Extent) {
        for (range, [first, last]) in self.0.iter_mut().zip(other.0) {
            *range = [range[0].min(first), range[1].max(last)];
        }
    }

    /// Number of cells from the first to the last.
    fn length(&self, axis: usize) -> f64 {
        let [first, last] = self.0[axis];
        (last + 1).saturating_sub(first) as f64
    }
}

/// The part of a window within limits.
pub(crate) fn within(window: Window, limits: Window) -> Window {
    [0, 1].map(|k| {
        [
            window[k][0].max(limits[k][0]),
            window[k][1].min(limits[k][1]),
        ]
    })
}

/// A first pressure: Hertz's law over the part of a gap that overlaps by more than half of a depth in mm. `cell` is the area of a cell in mm², `modulus` the contact
/// modulus in MPa.
pub(crate) fn first_pressure(gap: &[f64], depth: f64, cell: f64, modulus: f64) -> Vec<f64> {
    let least = gap.iter().copied().fold(f64::INFINITY, f64::min);
    let part = |gap: &f64| (1.0 - 2.0 * (gap - least) / depth).max(0.0);
    let inside = gap.iter().filter(|gap| part(gap) > 0.0).count();
    let radius = (inside as f64 * cell / PI).sqrt();
    let largest = 2.0 * modulus * depth / (PI * radius);
    gap.iter().map(|gap| largest * part(gap).sqrt()).collect()
}

/// Part of the load below which a patch need not be resolved.
pub(crate) const SHARE_MIN: f64 = 0.02;

/// Least number of cells across a resolved patch. The width and pressure of Hertz's contact are then accurate to 1 %.
pub(crate) const CELLS_ACROSS_MIN: f64 = 11.0;

/// Cells along either axis of a first grid over the box in which the contact is sought.
pub(crate) const FIRST: usize = 32;

/// Resolution of the last grid. With 44 cells across the contact the error of the resultants is below 0.0007 for nine of ten gaps (see `REGION` of
/// `error_estimate.rs`).
pub(crate) const RESOLUTION: GridFineness = GridFineness {
    contact: 44.0,
    settles: true,
    tolerance: 2e-4,
};

/// Targets of the error of the resultants, relative to μN, between which a contact has the cells of [`RESOLUTION`].
pub(crate) const TARGETS: [f64; 2] = [0.002, 0.005];

/// Largest ratio of a looser target to the upper one of [`TARGETS`] that reduces the number of cells, to 25. Gaps then take two thirds of the time
/// (`cargo bench --bench calibrate gap profiles`).
pub(crate) const LOOSER_MAX: f64 = 2.3;

/// Power of the allowed error with which the number of cells falls: the error falls with the power 3/2 of their number.
pub(crate) const CELLS_BY_ERROR: f64 = -2.0 / 3.0;

/// Ratio of the wanted to the present size of cells from which a grid is fine enough.
pub(crate) const COARSER_MAX: f64 = 0.8;

/// Change of the approach between grids at which a gap is resolved, relative to the depth of overlap and to the ratio of the sizes of cells.
pub(crate) const APPROACH_CHANGE: f64 = 0.002;

/// Relative change of the largest pressure between grids at which a gap is resolved, relative to the ratio of the sizes of cells.
pub(crate) const PRESSURE_CHANGE: f64 = 0.015;

/// Ratio of the numbers of cells along an axis of successive grids while the gap is not resolved.
pub(crate) const REFINEMENT: f64 = 1.6;

/// Violation of the contact conditions, relative to the deepest overlap, that ends the iteration on the first grid.
pub(crate) const TOLERANCE_FIRST: f64 = 2e-3;

/// Gap of a deformed surface over the deepest overlap below which a cell is part of the next grid.
pub(crate) const NEAR: f64 = 0.03;

/// The contact of a gap.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalAnswer {
    /// Region and pressure.
    pub field: PressureField,
    /// How it was solved.
    pub report: NormalWork,
    /// Remarks for the answer.
    pub remarks: Vec<RemarkEntry>,
}

/// Report of a normal problem.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NormalWork {
    /// Cells of the last grid along x and y; of the one with the largest load if there are several.
    pub cells: [usize; 2],
    /// Number of final grids: 1, or one per patch if patches differ much in size.
    pub grids: usize,
    /// Iterations over all grids.
    pub iterations: u32,
    /// Largest violation of the contact conditions on the last grid (distance in the contact, overlap outside), relative to the deepest overlap of the undeformed
    /// surfaces.
    pub residual: f64,
    /// Ratio of the largest pressure on the last grid but one to that on the last, minus 1; 0 with one grid.
    pub pressure_change: f64,
}

/// The reason why a normal problem has no solution.
#[derive(Debug, Clone, PartialEq)]
pub enum NormalError {
    /// A reason, as a sentence.
    NoAnswer(String),
    /// The caller stopped the work.
    Stopped(Stop),
}

impl From<conjugate_gradients::PressureFailure> for NormalError {
    fn from(failure: conjugate_gradients::PressureFailure) -> NormalError {
        match failure {
            conjugate_gradients::PressureFailure::Stopped(stop) => NormalError::Stopped(stop),
            conjugate_gradients::PressureFailure::NotConverged(residual) => {
                NormalError::NoAnswer(format!(
                    "the pressure did not converge: the contact conditions are violated by {residual:.1e} of the overlap"
                ))
            }
        }
    }
}

pub(crate) fn no_touch(approach: f64, least: f64) -> String {
    format!(
        "the bodies do not touch: the approach of {approach} mm is not more than the smallest gap of {least} mm"
    )
}

pub(crate) fn edge_reached(side: GridSide, limits: Window) -> NormalError {
    NormalError::NoAnswer(format!(
        "the contact reaches the edge {} of the given gap, so that the true contact is cut off; give the gap farther out",
        side.place(limits)
    ))
}

/// A grid with its distances and pressures, under the approach of all grids.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PatchGrid {
    pub(crate) grid: PressureGrid,
    pub(crate) pressed: PressureAnswer,
}

impl PatchGrid {
    /// A grid over a gap that does not touch at an approach.
    pub(crate) fn apart(grid: PressureGrid, mut gap: Vec<f64>, approach: f64) -> PatchGrid {
        gap.iter_mut().for_each(|gap| *gap -= approach);
        let pressed = PressureAnswer {
            pressure: vec![0.0; gap.len()],
            distance: gap,
            approach,
            iterations: 0,
            residual: 0.0,
        };
        PatchGrid { grid, pressed }
    }

    /// The load in N.
    pub(crate) fn load(&self) -> f64 {
        self.pressed.pressure.iter().sum::<f64>() * self.grid.step[0] * self.grid.step[1]
    }

    pub(crate) fn largest(&self) -> f64 {
        self.pressed.largest()
    }
}

/// The solution on the last grids.
pub(crate) struct GapOutcome {
    /// The grids with their pressures: one, or one per patch.
    pub(crate) patch_grids: Vec<PatchGrid>,
    /// Iterations over all grids.
    pub(crate) iterations: u32,
    /// Whether finer grids no longer change the result.
    pub(crate) settled: bool,
    /// See [`NormalWork`].
    pub(crate) pressure_change: f64,
    /// The least gap in mm.
    pub(crate) least: f64,
}

/// Outward displacement of the edge of the contact by a piecewise constant pressure: `(distance, displacement)` in cells along the normal.
///
/// Near an edge the square of the pressure falls linearly, so the distance from the edge follows from pressure and gradient. Measured on Hertz's contact (a/b 0.25 to 1.4,
/// 20 to 42 cells across, all positions and directions of the edge); the scatter is 0.02 up to a distance of 1.2, and 0.005 or less beyond.
const DISPLACEMENT: [(f64, f64); 18] = [
    (0.00, 0.090),
    (0.05, 0.020),
    (0.10, -0.030),
    (0.15, -0.060),
    (0.25, -0.070),
    (0.35, -0.065),
    (0.45, -0.050),
    (0.55, -0.035),
    (0.65, -0.014),
    (0.75, 0.012),
    (0.85, 0.027),
    (0.95, 0.036),
    (1.15, 0.034),
    (1.35, 0.029),
    (1.55, 0.020),
    (1.75, 0.016),
    (2.25, 0.010),
    (4.00, 0.007),
];

/// The squared pressures corrected for the grid: moved back by [`DISPLACEMENT`], so that they vanish at the edge. Cells without pressure keep 0; others become negative if
/// the edge excludes their centre.
///
/// `pressure` belongs to a grid with `nx` cells along x.
pub(crate) fn squares(nx: usize, pressure: &[f64]) -> Vec<f64> {
    let square: Vec<f64> = pressure.iter().map(|p| p * p).collect();
    let mut moved = square.clone();
    let ny = pressure.len() / nx;
    for j in 0..ny {
        let row = j * nx;
        for i in 0..nx {
            let own = square[row + i];
            if own <= 0.0 {
                continue;
            }
            let along = slope(i, nx, |i| square[row + i]);
            let across = slope(j, ny, |j| square[i + j * nx]);
            let slope = (along * along + across * across).sqrt();
            if slope > 0.0 {
                moved[row + i] = own - slope * displacement(own / slope);
            }
        }
    }
    moved
}

/// Change per cell at cell `i` of a line of `n`, from cells in contact only. At the edge, where the value of a cell is inaccurate, it is that between the two inner
/// neighbours.
#[inline]
fn slope(i: usize, n: usize, square: impl Fn(usize) -> f64) -> f64 {
    let before = if i > 0 { square(i - 1) } else { 0.0 };
    let after = if i + 1 < n { square(i + 1) } else { 0.0 };
    if before > 0.0 && after > 0.0 {
        return 0.5 * (after - before);
    }
    let before2 = if i > 1 { square(i - 2) } else { 0.0 };
    let after2 = if i + 2 < n { square(i + 2) } else { 0.0 };
    match (before > 0.0, after > 0.0) {
        (true, false) if before2 > 0.0 => before - before2,
        (false, true) if after2 > 0.0 => after2 - after,
        _ => 0.0,
    }
}

fn displacement(distance: f64) -> f64 {
    let (last, far) = DISPLACEMENT[DISPLACEMENT.len() - 1];
    if distance >= last {
        return far;
    }
    let next = DISPLACEMENT.partition_point(|(at, _)| *at <= distance);
    let ((x0, y0), (x1, y1)) = (DISPLACEMENT[next - 1], DISPLACEMENT[next]);
    y0 + (y1 - y0) * (distance - x0) / (x1 - x0)
}

/// Interpolates values bilinearly at places `[x, y]` in cells from the first centre. `row` returns the `width` values of a row; values outside are 0.
pub(crate) fn bilinear<'v>(
    [x, y]: &[Vec<f64>; 2],
    width: usize,
    row: impl Fn(i64) -> Option<&'v [f64]>,
) -> Vec<f64> {
    let place = |at: &f64| (at.floor() as i64, at - at.floor());
    // A row has one additional value at both ends.
    let beyond = |i: i64| (i.clamp(-1, width as i64) + 1) as usize;
    let columns: Vec<([usize; 2], f64)> = x
        .iter()
        .map(place)
        .map(|(i, u)| ([i, i + 1].map(beyond), u))
        .collect();
    let mut sums = vec![0.0; width + 2];
    let mut out = Vec::with_capacity(x.len() * y.len());
    for (j, v) in y.iter().map(place) {
        sums.fill(0.0);
        for (j, share) in [(j, 1.0 - v), (j + 1, v)] {
            let values = row(j).into_iter().flatten();
            let sums = sums[1..=width].iter_mut().zip(values);
            sums.for_each(|(sum, value)| *sum += share * value);
        }
        let at = |([low, high], u): &([usize; 2], f64)| (1.0 - u) * sums[*low] + u * sums[*high];
        out.extend(columns.iter().map(at));
    }
    out
}

/// Continues the squares below 0 in the cells next to the contact: the mean over all eight directions of the extrapolation from two cells inside in a row, or the negative
/// of one cell if there is only one.
pub(crate) fn continued(nx: usize, squares: Vec<f64>) -> Vec<f64> {
    let ny = squares.len() / nx;
    let value = |i: isize, j: isize| {
        let inside = (0..nx as isize).contains(&i) && (0..ny as isize).contains(&j);
        let value = if inside {
            squares[j as usize * nx + i as usize]
        } else {
            0.0
        };
        (value > 0.0).then_some(value)
    };
    let beyond = |i: isize, j: isize| {
        let (mut sum, mut count) = (0.0, 0.0);
        for (di, dj) in (-1..=1).flat_map(|dj| (-1..=1).map(move |di| (di, dj))) {
            if let Some(near) = value(i + di, j + dj) {
                let far = value(i + 2 * di, j + 2 * dj);
                sum += far.map_or(-near, |far| 2.0 * near - far).min(0.0);
                count += 1.0;
            }
        }
        if count > 0.0 { sum / count } else { 0.0 }
    };
    let mut out = squares.clone();
    let row_of = |j: usize| squares[j * nx..(j + 1) * nx].iter();
    // The first and the last cell in contact of every row.
    let ends: Vec<Option<[usize; 2]>> = (0..ny)
        .map(|j| {
            let first = row_of(j).position(|square| *square > 0.0)?;
            Some([first, row_of(j).rposition(|square| *square > 0.0)?])
        })
        .collect();
    for j in 0..ny {
        let near = &ends[j.saturating_sub(1)..(j + 2).min(ny)];
        let first = near.iter().flatten().map(|ends| ends[0]).min();
        let last = near.iter().flatten().map(|ends| ends[1]).max();
        let (Some(first), Some(last)) = (first, last) else {
            continue;
        };
        for i in first.saturating_sub(1)..(last + 2).min(nx) {
            if squares[j * nx + i] == 0.0 {
                out[j * nx + i] = beyond(i as isize, j as isize);
            }
        }
    }
    out
}
