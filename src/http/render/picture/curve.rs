//! Draws a creep curve: forces over the motions of a case, with error bars.

use std::fmt::Write;

use crate::render::picture::chart::{Chart, WIDTH, legend_line, open, roomy};
use crate::render::picture::svg::{Anchor, Svg, polyline, px};

/// Height of the picture in its units.
const HEIGHT: f64 = 480.0;
/// Least distance of error bars, in units of the picture.
const BAR_SPACING: f64 = 9.0;
/// Share of the friction limit above which a force makes the limit visible.
const BOUND_IN_SIGHT: f64 = 0.4;
/// Colour and dashes of the lines, in their order.
const STYLES: [&str; 2] = [
    "stroke=\"#0b5a9e\"",
    "stroke=\"#b4530a\" stroke-dasharray=\"7 3\"",
];

/// A creep curve.
#[derive(Debug, Clone)]
pub(crate) struct Curve {
    /// The title, a text of the client.
    pub title: String,
    /// At most two lines below the title.
    pub remarks: Vec<String>,
    /// Name of the horizontal axis.
    pub x_name: String,
    /// Values of the horizontal axis.
    pub x: Vec<f64>,
    /// At most two lines.
    pub lines: Vec<CurveLine>,
    /// The friction limit in N, if it is known.
    pub bound: Option<f64>,
}

/// One line of a creep curve.
#[derive(Debug, Clone)]
pub(crate) struct CurveLine {
    /// Its name.
    pub name: &'static str,
    /// Its values.
    pub y: Vec<f64>,
    /// Estimated errors of the values.
    pub error: Vec<Option<f64>>,
}

/// Draws a creep curve as SVG, `width` pixels wide.
#[must_use]
pub(crate) fn draw(curve: &Curve, width: u32) -> Svg {
    let mut order: Vec<usize> = (0..curve.x.len()).collect();
    order.sort_by(|a, b| curve.x[*a].total_cmp(&curve.x[*b]));
    let reach = curve.lines.iter().flat_map(|line| {
        let ends = line.y.iter().zip(&line.error);
        ends.flat_map(|(y, error)| [y - error.unwrap_or(0.0), y + error.unwrap_or(0.0)])
    });
    let largest = reach.clone().map(f64::abs).fold(0.0, f64::max);
    let bound = curve.bound.filter(|bound| largest > BOUND_IN_SIGHT * bound);
    let ys: Vec<f64> = reach.chain([0.0]).collect();
    let signs = [(1.0, f64::max as fn(f64, f64) -> f64), (-1.0, f64::min)];
    let bounds: Vec<f64> = signs
        .into_iter()
        .filter_map(|(sign, end)| {
            let reached = ys.iter().copied().fold(0.0, end);
            let bound = bound?;
            (sign * reached > BOUND_IN_SIGHT * bound).then_some(sign * bound)
        })
        .collect();
    let chart = Chart {
        area: [78.0, 96.0, WIDTH - 108.0, HEIGHT - 190.0],
        x: roomy(curve.x.iter().copied()),
        y: roomy(ys.into_iter().chain(bounds.iter().copied())),
    };
    let mut svg = open(&curve.title, &curve.remarks, width, HEIGHT);
    chart.grid(&mut svg);
    for bound in &bounds {
        let ends = chart.x.map(|x| chart.at(x, *bound));
        let line = polyline(ends, false);
        svg.path(
            &line,
            "fill=\"none\" stroke=\"#555\" stroke-dasharray=\"2 3\"",
        );
        let (x, y) = ends[1];
        svg.text((x - 6.0, y - 5.0), 11.0, Anchor::End, "fill=\"#555\"", "μN");
    }
    for (line, style) in curve.lines.iter().zip(STYLES) {
        draw_line(&mut svg, &chart, curve, line, &order, style);
    }
    chart.axes(&mut svg, [&curve.x_name, "force in N"]);
    legend(&mut svg, curve);
    svg
}

fn draw_line(
    svg: &mut Svg,
    chart: &Chart,
    curve: &Curve,
    line: &CurveLine,
    order: &[usize],
    style: &str,
) {
    let places = order.iter().map(|k| chart.at(curve.x[*k], line.y[*k]));
    let data = polyline(places, false);
    svg.path(
        &data,
        &format!("fill=\"none\" {style} stroke-width=\"1.8\" stroke-linejoin=\"round\""),
    );
    let mut bars = String::new();
    let mut last = f64::NEG_INFINITY;
    for k in order {
        let x = curve.x[*k];
        let (at, _) = chart.at(x, 0.0);
        let Some(error) = line.error[*k].filter(|_| at - last >= BAR_SPACING) else {
            continue;
        };
        last = at;
        let ends = [line.y[*k] - error, line.y[*k] + error].map(|y| chart.at(x, y).1);
        let _ = write!(bars, "M{} {}V{}", px(at), px(ends[0]), px(ends[1]));
        for end in ends {
            let _ = write!(bars, "M{} {}h5", px(at - 2.5), px(end));
        }
    }
    let solid = style.split(" stroke-dasharray").next().unwrap_or(style);
    svg.path(&bars, &format!("fill=\"none\" {solid}"));
}

fn legend(svg: &mut Svg, curve: &Curve) {
    let y = HEIGHT - 30.0;
    let mut x = 78.0;
    for (line, style) in curve.lines.iter().zip(STYLES) {
        let style = format!("{style} stroke-width=\"1.8\"");
        legend_line(svg, (x, y), &style, line.name);
        x += 190.0;
    }
    let note = "on the lower body; bars are the estimated errors";
    svg.text((x, y), 12.0, Anchor::Start, "fill=\"#444\"", note);
}
