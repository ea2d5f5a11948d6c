//! Draws points on two logarithmic axes.

use std::fmt::Write as _;

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 400.0;
const LEFT: f64 = 70.0;
const RIGHT: f64 = 170.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 48.0;
/// Colours that also differ in lightness, with a mark for each.
const INKS: [(&str, Mark); 5] = [
    ("#08306b", Mark::Disc),
    ("#d95f02", Mark::Square),
    ("#238b45", Mark::Ring),
    ("#808080", Mark::Cross),
    ("#7b3294", Mark::Disc),
];

#[derive(Clone, Copy)]
enum Mark {
    Disc,
    Square,
    Ring,
    Cross,
}

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

/// An axis from one power of ten to another.
struct Axis {
    low: i32,
    high: i32,
    from: f64,
    to: f64,
}

impl Axis {
    fn new(values: impl Iterator<Item = f64> + Clone, from: f64, to: f64) -> Axis {
        let low = values.clone().fold(f64::INFINITY, f64::min).log10().floor() as i32;
        let high = values.fold(f64::NEG_INFINITY, f64::max).log10().ceil() as i32;
        Axis {
            low,
            high: high.max(low + 1),
            from,
            to,
        }
    }

    fn place(&self, value: f64) -> f64 {
        let share = (value.log10() - f64::from(self.low)) / f64::from(self.high - self.low);
        self.from + share * (self.to - self.from)
    }
}

impl Plot {
    pub fn svg(&self) -> String {
        let points = || self.series.iter().flat_map(|s| s.points.iter().copied());
        let x = Axis::new(points().map(|p| p.0), LEFT, WIDTH - RIGHT);
        let y = Axis::new(points().map(|p| p.1), HEIGHT - BOTTOM, TOP);
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"12\">\n\
             <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n<text x=\"{LEFT}\" y=\"20\" font-size=\"14\">{}</text>\n",
            self.title
        );
        self.grid(&mut out, &x, &y);
        for (k, series) in self.series.iter().enumerate() {
            let (ink, mark) = INKS[k % INKS.len()];
            let at = |p: &(f64, f64)| (x.place(p.0), y.place(p.1));
            let line: Vec<String> = series
                .points
                .iter()
                .map(|p| format!("{:.1},{:.1}", at(p).0, at(p).1))
                .collect();
            let _ = writeln!(
                out,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{ink}\"/>",
                line.join(" ")
            );
            for p in &series.points {
                draw(&mut out, at(p), ink, mark);
            }
            let height = TOP + 14.0 + 20.0 * k as f64;
            draw(&mut out, (WIDTH - RIGHT + 20.0, height - 4.0), ink, mark);
            let _ = writeln!(
                out,
                "<text x=\"{}\" y=\"{height}\">{}</text>",
                WIDTH - RIGHT + 32.0,
                series.name
            );
        }
        out.push_str("</svg>\n");
        out
    }

    fn grid(&self, out: &mut String, x: &Axis, y: &Axis) {
        for power in x.low..=x.high {
            let at = x.place(10.0_f64.powi(power));
            let _ = writeln!(
                out,
                "<path d=\"M{at:.1} {TOP}V{}\" stroke=\"#ddd\"/><text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                HEIGHT - BOTTOM,
                HEIGHT - BOTTOM + 16.0,
                label(power)
            );
        }
        for power in y.low..=y.high {
            let at = y.place(10.0_f64.powi(power));
            let _ = writeln!(
                out,
                "<path d=\"M{LEFT} {at:.1}H{}\" stroke=\"#ddd\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                WIDTH - RIGHT,
                LEFT - 6.0,
                at + 4.0,
                label(power)
            );
        }
        let middle = 0.5 * (LEFT + WIDTH - RIGHT);
        let _ = writeln!(
            out,
            "<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n\
             <text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            HEIGHT - 10.0,
            self.x,
            0.5 * (TOP + HEIGHT - BOTTOM),
            self.y
        );
    }
}

fn label(power: i32) -> String {
    if (-4..=4).contains(&power) {
        format!("{}", 10.0_f64.powi(power))
    } else {
        format!("1e{power}")
    }
}

fn draw(out: &mut String, (x, y): (f64, f64), ink: &str, mark: Mark) {
    let _ = match mark {
        Mark::Disc => writeln!(
            out,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{ink}\"/>"
        ),
        Mark::Square => writeln!(
            out,
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"8\" height=\"8\" fill=\"{ink}\"/>",
            x - 4.0,
            y - 4.0
        ),
        Mark::Ring => writeln!(
            out,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"white\" stroke=\"{ink}\" stroke-width=\"2\"/>"
        ),
        Mark::Cross => writeln!(
            out,
            "<path d=\"M{:.1} {:.1}l8 8m0 -8l-8 8\" stroke=\"{ink}\" stroke-width=\"2\"/>",
            x - 4.0,
            y - 4.0
        ),
    };
}
