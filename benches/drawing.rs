//! Draws outlines, curves and points as SVG.

use std::fmt::Write as _;

/// Colours that also differ in lightness, with the dashes of their lines.
const INKS: [(&str, &str); 6] = [
    ("#08306b", "none"),
    ("#d95f02", "9 3"),
    ("#238b45", "none"),
    ("#7b3294", "4 3"),
    ("#8c510a", "none"),
    ("#666666", "2 3"),
];

/// The style of a drawn curve.
#[derive(Clone, Copy)]
pub enum Curve {
    /// The edge of a patch.
    Border,
    /// The n-th of several lines.
    Line(usize),
    /// A filled zone.
    Slip,
    Stick,
}

impl Curve {
    fn style(self) -> String {
        match self {
            Curve::Border => "fill=\"none\" stroke=\"black\" stroke-width=\"1.5\"".to_owned(),
            Curve::Line(k) => {
                let (ink, dashes) = INKS[k % INKS.len()];
                format!(
                    "fill=\"none\" stroke=\"{ink}\" stroke-width=\"1.8\" stroke-dasharray=\"{dashes}\""
                )
            }
            Curve::Slip => "fill=\"#e8e8e8\"".to_owned(),
            Curve::Stick => {
                "fill=\"#2b5d8a\" fill-rule=\"evenodd\" stroke=\"#2b5d8a\" stroke-width=\"1.5\""
                    .to_owned()
            }
        }
    }
}

/// A rectangle of the picture and the values at its sides.
#[derive(Clone, Copy)]
pub struct Frame {
    pub x: [f64; 2],
    pub y: [f64; 2],
    /// Whether the values are decimal logarithms. The ticks are then powers of ten.
    pub logarithmic: bool,
    pub left: f64,
    pub right: f64,
    pub bottom: f64,
    pub top: f64,
}

impl Frame {
    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let share = |value: f64, [low, high]: [f64; 2]| (value - low) / (high - low);
        [
            self.left + share(x, self.x) * (self.right - self.left),
            self.bottom + share(y, self.y) * (self.top - self.bottom),
        ]
    }

    fn path(&self, points: &[[f64; 2]]) -> String {
        let mut data = String::new();
        for (k, point) in points.iter().enumerate() {
            let [x, y] = self.place(*point);
            let _ = write!(data, "{}{x:.1} {y:.1}", if k == 0 { 'M' } else { 'L' });
        }
        data
    }
}

/// Returns whole numbers in a range, or about five round ones, with their labels.
fn ticks([low, high]: [f64; 2], logarithmic: bool) -> Vec<(f64, String)> {
    if logarithmic {
        let powers = low as i32..=high as i32;
        return powers.map(|k| (f64::from(k), power_of_ten(k))).collect();
    }
    let rough = (high - low) / 5.0;
    let power = 10.0_f64.powf(rough.log10().floor());
    let factors = [1.0, 2.0, 5.0, 10.0];
    let step = factors.map(|factor| factor * power);
    let step = step
        .into_iter()
        .find(|step| *step >= rough)
        .unwrap_or(rough);
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    let values = (first..=last).map(|k| k as f64 * step);
    values.map(|value| (value, label(value))).collect()
}

fn label(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn power_of_ten(power: i32) -> String {
    match power {
        -4..=4 => format!("{}", 10.0_f64.powi(power)),
        _ => format!("1e{power}"),
    }
}

/// The body of an SVG picture.
pub struct Picture {
    body: String,
}

impl Picture {
    pub fn new(width: f64, height: f64, title: &str) -> Picture {
        let body = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n\
             <text x=\"20\" y=\"24\" font-size=\"14\">{title}</text>\n"
        );
        Picture { body }
    }

    pub fn svg(self) -> String {
        self.body + "</svg>\n"
    }

    fn add(&mut self, element: &str) {
        self.body.push_str(element);
        self.body.push('\n');
    }

    pub fn text(&mut self, [x, y]: [f64; 2], text: &str) {
        self.add(&format!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{text}</text>"
        ));
    }

    /// Draws closed loops.
    pub fn loops(&mut self, frame: &Frame, loops: &[Vec<[f64; 2]>], curve: Curve) {
        let data: String = loops.iter().map(|l| frame.path(l) + "Z").collect();
        self.add(&format!("<path d=\"{data}\" {}/>", curve.style()));
    }

    pub fn line(&mut self, frame: &Frame, points: &[[f64; 2]], curve: Curve) {
        self.add(&format!(
            "<path d=\"{}\" {}/>",
            frame.path(points),
            curve.style()
        ));
    }

    /// Draws a disc at each point, in the colour of a line.
    pub fn points(&mut self, frame: &Frame, points: &[[f64; 2]], line: usize) {
        let (ink, _) = INKS[line % INKS.len()];
        for point in points {
            let [x, y] = frame.place(*point);
            self.add(&format!(
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{ink}\"/>"
            ));
        }
    }

    pub fn key(&mut self, x: f64, y: f64, curve: Curve, name: &str) {
        self.add(&format!(
            "<path d=\"M{x} {y}h34\" {}/><text x=\"{}\" y=\"{}\">{name}</text>",
            curve.style(),
            x + 42.0,
            y + 4.0
        ));
    }

    /// Draws ticks with values below and at the left, and the names of the axes.
    pub fn axes(&mut self, frame: &Frame, x: &str, y: &str) {
        for (value, label) in ticks(frame.x, frame.logarithmic) {
            let [at, _] = frame.place([value, frame.y[0]]);
            self.add(&format!(
                "<path d=\"M{at:.1} {}V{}\" stroke=\"#ddd\"/>",
                frame.top, frame.bottom
            ));
            self.text([at, frame.bottom + 16.0], &label);
        }
        for (value, label) in ticks(frame.y, frame.logarithmic) {
            let [_, at] = frame.place([frame.x[0], value]);
            self.add(&format!(
                "<path d=\"M{} {at:.1}H{}\" stroke=\"#ddd\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                frame.left,
                frame.right,
                frame.left - 6.0,
                at + 4.0
            ));
        }
        self.text([0.5 * (frame.left + frame.right), frame.bottom + 36.0], x);
        self.upright(18.0, frame, y);
    }

    /// Draws ticks with values at the right, and the name of the axis.
    pub fn right_axis(&mut self, frame: &Frame, y: &str) {
        for (value, label) in ticks(frame.y, frame.logarithmic) {
            let [_, at] = frame.place([frame.x[0], value]);
            self.add(&format!(
                "<text x=\"{}\" y=\"{:.1}\">{label}</text>",
                frame.right + 6.0,
                at + 4.0
            ));
        }
        self.upright(frame.right + 60.0, frame, y);
    }

    fn upright(&mut self, x: f64, frame: &Frame, text: &str) {
        let y = 0.5 * (frame.top + frame.bottom);
        self.add(&format!(
            "<text transform=\"translate({x} {y:.1}) rotate(-90)\" text-anchor=\"middle\">{text}</text>"
        ));
    }
}
