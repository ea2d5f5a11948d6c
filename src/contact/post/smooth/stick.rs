//! The border between stick and slip, from the margin of the traction to friction's bound.

use crate::contact::post::smooth::contour::signed_area;
use crate::contact::post::smooth::sheet::{AtBorder, Sheet, SheetStrip};
use crate::contact::solution::words::fields::Zone;
use crate::contact::solution::words::fields::{PatchCells, PointFields};

impl Sheet {
    /// Closed curves around the stick zone in mm, counter-clockwise, holes clockwise; `None` where zones are not known.
    ///
    /// Along every strip the border stands where the margin to friction's bound vanishes: its square, which is linear beside the border
    /// in Carter's problem (1926), is continued from the last two cells that stick, at most to the middle of the cell that slips. Where
    /// pressure or traction is not known it is half-way. From strip to strip a function that vanishes there is interpolated, which closes
    /// zones that end between strips. Pieces smaller than the largest cell are left out.
    #[must_use]
    pub fn stick(&self, cells: &PatchCells, values: &PointFields) -> Option<Vec<Vec<[f64; 2]>>> {
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

/// What is needed to find where the bound is reached.
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

    /// Where the bound is reached beside the cell `near` that sticks, `far` behind it, toward `slipping`.
    fn reached(&self, x: &[f64], far: usize, near: usize, slipping: usize) -> Option<f64> {
        // Where it slips the bound is reached: this is the coefficient of friction here, whatever law it follows.
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

/// Where along a strip stick and slip change, as shares of its length.
struct ZoneChanges {
    places: Vec<f64>,
    /// It sticks before the first change.
    sticks_first: bool,
}

impl ZoneChanges {
    fn of(
        strip: &SheetStrip,
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

    /// Positive where it sticks, negative where it slips, a parabola between two changes: then the squared width of a zone is linear from
    /// strip to strip, and its end is round. The outermost parts reach their largest value at the end of the strip.
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

    /// The size of the value of a strip without a change: as large as the opposite zone of the strips beside it, so that this zone ends
    /// half-way.
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
    use super::*;
    use crate::contact::post::strip_segments::samples::ellipse;

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
        // Its trailing end at y: chord − 2 (chord − shrink).
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
