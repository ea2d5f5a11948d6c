//! Draws points on two logarithmic axes.

use crate::drawing::{Curve, Frame, Picture};

/// Points joined by a line.
pub struct Series {
    pub name: String,
    pub points: Vec<(f64, f64)>,
}

pub struct Plot {
    pub title: String,
    pub x: String,
    pub y: String,
    pub series: Vec<Series>,
}

/// Returns the exponents of the powers of ten that enclose some values.
fn exponents(values: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
    let low = values.clone().fold(f64::INFINITY, f64::min).log10().floor();
    let high = values.fold(f64::NEG_INFINITY, f64::max).log10().ceil();
    [low, high.max(low + 1.0)]
}

impl Plot {
    pub fn svg(&self) -> String {
        let points = || self.series.iter().flat_map(|series| &series.points);
        let frame = Frame {
            x: exponents(points().map(|point| point.0)),
            y: exponents(points().map(|point| point.1)),
            logarithmic: true,
            left: 70.0,
            right: 470.0,
            bottom: 352.0,
            top: 40.0,
        };
        let mut picture = Picture::new(640.0, 400.0, &self.title);
        picture.axes(&frame, &self.x, &self.y);
        for (k, series) in self.series.iter().enumerate() {
            let points = series.points.iter();
            let points: Vec<_> = points.map(|(x, y)| [x.log10(), y.log10()]).collect();
            picture.line(&frame, &points, Curve::Line(k));
            picture.points(&frame, &points, k);
            picture.key(480.0, 50.0 + 20.0 * k as f64, Curve::Line(k), &series.name);
        }
        picture.svg()
    }
}
