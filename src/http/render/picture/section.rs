//! Draws sections of a patch through its largest traction, with traction and friction bound.

use crate::render::picture::chart::{Chart, WIDTH, legend_line, open};
use crate::render::picture::svg::{Anchor, Svg, polyline};
use railhead_contact::solution::words::answer::{PatchCells, PointFields, Zone};

/// Height of the picture in its units.
const HEIGHT: f64 = 460.0;
/// Space left of the first panel, between both panels, and right of the second.
const GAPS: [f64; 3] = [78.0, 62.0, 24.0];
/// Interpolated points between two cells.
const STEPS: u32 = 8;
const TRACTION: &str = "stroke=\"#0b5a9e\" stroke-width=\"1.9\"";
const BOUND: &str = "stroke=\"#555\" stroke-dasharray=\"5 4\"";
const STICK: &str = "fill=\"#d4e5f3\"";

/// Sections of a patch.
#[derive(Debug, Clone)]
pub(crate) struct Sections {
    /// The title, a text of the client.
    pub title: String,
    /// At most two lines below the title.
    pub remarks: Vec<String>,
    /// The cells.
    pub cells: PatchCells,
    /// The values of one motion.
    pub values: PointFields,
    /// Coefficient of friction; `None` if it varies.
    pub friction: Option<f64>,
}

/// A section: its points, the parts that stick, and its names.
struct SectionLine {
    /// Position, |t| and μp; μp is NaN if it is not known.
    points: Vec<[f64; 3]>,
    sticks: Vec<[f64; 2]>,
    name: String,
    x_name: &'static str,
}

/// Draws sections as SVG, `width` pixels wide.
#[must_use]
pub(crate) fn draw(sections: &Sections, width: u32) -> Svg {
    let both = [0, 1].map(|axis| section(sections, axis));
    let values = both.iter().flat_map(|section| &section.points);
    let largest = values
        .map(|[_, traction, bound]| traction.max(if bound.is_nan() { 0.0 } else { *bound }))
        .fold(0.0, f64::max);
    let top = if largest > 0.0 { 1.08 * largest } else { 1.0 };
    let room = WIDTH - GAPS.iter().sum::<f64>();
    let lengths = both.each_ref().map(|section| {
        let ends = [section.points.first(), section.points.last()];
        ends[1].map_or(1.0, |end| end[0]) - ends[0].map_or(0.0, |end| end[0])
    });
    // Both panels have the same scale, within limits.
    let share = (lengths[0] / (lengths[0] + lengths[1])).clamp(0.3, 0.7);
    let mut svg = open(&sections.title, &sections.remarks, width, HEIGHT);
    let mut left = GAPS[0];
    for (section, share) in both.iter().zip([share, 1.0 - share]) {
        let ends = [section.points.first(), section.points.last()];
        let [from, to] = ends.map(|end| end.map_or(0.0, |end| end[0]));
        let chart = Chart {
            area: [left, 112.0, share * room, HEIGHT - 210.0],
            x: if from < to {
                [from, to]
            } else {
                [from - 1.0, from + 1.0]
            },
            y: [0.0, top],
        };
        draw_section(&mut svg, &chart, section);
        left += share * room + GAPS[1];
    }
    legend(&mut svg, sections.friction.is_some());
    svg
}

fn draw_section(svg: &mut Svg, chart: &Chart, section: &SectionLine) {
    let [_, top, _, height] = chart.area;
    for [from, to] in &section.sticks {
        let [x0, x1] = [from, to].map(|x| chart.at(*x, 0.0).0);
        svg.rect([x0, top, x1 - x0, height], STICK);
    }
    chart.grid(svg);
    let line = |column: usize| {
        let known = section
            .points
            .iter()
            .filter(|point| !point[column].is_nan());
        polyline(known.map(|point| chart.at(point[0], point[column])), false)
    };
    svg.path(&line(2), &format!("fill=\"none\" {BOUND}"));
    svg.path(&line(1), &format!("fill=\"none\" {TRACTION}"));
    chart.axes(svg, [section.x_name, "MPa"]);
    let (x, y) = (chart.area[0] + chart.area[2], top - 8.0);
    svg.text((x, y), 12.0, Anchor::End, "fill=\"#444\"", &section.name);
}

fn legend(svg: &mut Svg, bounded: bool) {
    let y = HEIGHT - 26.0;
    legend_line(svg, (78.0, y), TRACTION, "traction |t|");
    if bounded {
        legend_line(svg, (230.0, y), BOUND, "bound of friction μp");
    }
    let stick = format!("{STICK} stroke=\"#333\"");
    svg.rect([430.0, y - 10.0, 22.0, 12.0], &stick);
    svg.text((459.0, y), 12.0, Anchor::Start, "", "stick");
}

impl Sections {
    fn traction(&self, cell: usize) -> f64 {
        let part = |part: &Option<Vec<f64>>| part.as_ref().map_or(0.0, |values| values[cell]);
        part(&self.values.traction_x_mpa).hypot(part(&self.values.traction_y_mpa))
    }

    /// Returns the friction bound; NaN if it is not known.
    fn bound(&self, cell: usize) -> f64 {
        let pressure = self.cells.pressure_mpa.as_ref().map(|values| values[cell]);
        pressure
            .zip(self.friction)
            .map_or(f64::NAN, |(pressure, friction)| friction * pressure)
    }

    fn sticks(&self, cell: usize) -> bool {
        let zones = self.values.zone.as_ref();
        zones.is_some_and(|zones| zones[cell] == Zone::Stick)
    }

    /// Returns the cell with the largest traction.
    fn peak(&self) -> usize {
        let cells = 0..self.cells.x_mm.len();
        cells
            .max_by(|a, b| self.traction(*a).total_cmp(&self.traction(*b)))
            .unwrap_or(0)
    }
}

/// Returns the section along rolling (axis 0), through the strip with the largest traction, or across (axis 1), through the cells of all strips
/// at the x of the largest traction. Between the centres of cells the square of a value is linear, and zero at the border, as for the pressure
/// of Hertz.
fn section(of: &Sections, axis: usize) -> SectionLine {
    let (cells, peak) = (&of.cells, of.peak());
    let centres = [&cells.x_mm, &cells.y_mm];
    let widths = [&cells.dx_mm, &cells.dy_mm];
    let at = centres[1 - axis].get(peak).copied().unwrap_or(0.0);
    let is_cut = |cell: &usize| match axis {
        0 => cells.strip[*cell] == cells.strip[peak],
        _ => (cells.x_mm[*cell] - at).abs() <= 0.5 * cells.dx_mm[*cell],
    };
    let mut own: Vec<usize> = (0..cells.x_mm.len()).filter(is_cut).collect();
    own.sort_by(|a, b| centres[axis][*a].total_cmp(&centres[axis][*b]));
    if axis == 1 {
        own.dedup_by_key(|cell| cells.strip[*cell]);
    }
    let spans = own.into_iter().map(|cell| {
        let (middle, half) = (centres[axis][cell], 0.5 * widths[axis][cell]);
        (cell, [middle - half, middle + half])
    });
    let spans: Vec<(usize, [f64; 2])> = spans.collect();
    let (place, x_name) = match axis {
        0 => ("along rolling at y", "x in mm"),
        _ => ("across at x", "y in mm"),
    };
    let at = format!("{at:.2}").replace('-', "−");
    let sticks = spans.iter().filter(|(cell, _)| of.sticks(*cell));
    let sticks = sticks.map(|(_, span)| *span).collect();
    let middle = |(cell, [from, to]): &(usize, [f64; 2])| {
        [0.5 * (from + to), of.traction(*cell), of.bound(*cell)]
    };
    let end = |place: f64, beside: &[f64; 3]| [place, 0.0, 0.0 * beside[2]];
    let middles: Vec<[f64; 3]> = spans.iter().map(middle).collect();
    let mut knots = Vec::new();
    if let (Some(first), Some(last)) = (spans.first(), spans.last()) {
        knots.push(end(first.1[0], &middles[0]));
        knots.extend(&middles);
        knots.push(end(last.1[1], &middles[middles.len() - 1]));
    }
    let mut points: Vec<[f64; 3]> = knots.first().copied().into_iter().collect();
    for pair in knots.windows(2) {
        for step in 1..=STEPS {
            let share = f64::from(step) / f64::from(STEPS);
            let straight = |k: usize| pair[0][k] * (1.0 - share) + pair[1][k] * share;
            let rooted = |k: usize| {
                let square = pair[0][k].powi(2) * (1.0 - share) + pair[1][k].powi(2) * share;
                square.sqrt()
            };
            points.push([straight(0), rooted(1), rooted(2)]);
        }
    }
    SectionLine {
        points,
        sticks,
        name: format!("{place} = {at} mm"),
        x_name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_of_a_hertzian_pressure_is_round_and_ends_at_nothing() {
        let cells = 16;
        let width = 2.0 / f64::from(cells);
        let x: Vec<f64> = (0..cells)
            .map(|k| (f64::from(k) + 0.5) * width - 1.0)
            .collect();
        let pressure: Vec<f64> = x.iter().map(|x| (1.0 - x * x).sqrt()).collect();
        let of = Sections {
            title: String::new(),
            remarks: Vec::new(),
            cells: PatchCells {
                dx_mm: vec![width; x.len()],
                y_mm: vec![0.0; x.len()],
                dy_mm: vec![0.1; x.len()],
                strip: vec![0; x.len()],
                pressure_mpa: Some(pressure.clone()),
                x_mm: x,
            },
            values: PointFields {
                traction_x_mpa: Some(pressure),
                traction_y_mpa: Some(vec![0.0; 16]),
                ..PointFields::default()
            },
            friction: Some(1.0),
        };
        let section = section(&of, 0);
        for [x, traction, bound] in &section.points {
            let exact = (1.0 - x * x).max(0.0).sqrt();
            assert!(
                (traction - exact).abs() < 0.1 && (traction - bound).abs() < 1e-12,
                "{x}"
            );
        }
        assert_eq!(section.points.first().map(|point| point[1]), Some(0.0));
        assert!(draw(&of, 800).finish().ends_with("</svg>\n"));
    }
}
