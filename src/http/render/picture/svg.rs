//! Writes SVG. Every text of a client passes through [`escape`].

use std::fmt::Write;

/// Fonts in order of preference; raster pictures use the first.
pub(super) const FONTS: &str = "DejaVu Sans, Verdana, sans-serif";

/// An SVG drawing. Its first markup opens the element `svg`.
#[derive(Debug, Default)]
pub(crate) struct Svg {
    /// Markup and lines of text, in order.
    parts: Vec<Part>,
}

#[derive(Debug)]
enum Part {
    Markup(String),
    Line(Line),
}

/// A line of text.
#[derive(Debug)]
pub(super) struct Line {
    /// Position of the anchor.
    pub at: (f64, f64),
    /// Font size.
    pub size: f64,
    /// The part of the text at the position.
    pub anchor: Anchor,
    /// Further attributes.
    pub attributes: String,
    /// The text.
    pub text: String,
}

/// The part of a text that is at its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    /// The beginning.
    Start,
    /// The middle.
    Middle,
    /// The end.
    End,
}

impl Svg {
    /// Adds an element without content; `attributes` is not escaped.
    pub(super) fn element(&mut self, name: &str, attributes: &str) {
        self.raw(&format!("<{name} {attributes}/>\n"));
    }

    /// Adds a rectangle `[x, y, width, height]`.
    pub(super) fn rect(&mut self, area: [f64; 4], attributes: &str) {
        let [x, y, width, height] = area.map(px);
        let place = format!("x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"");
        self.element("rect", &format!("{place} {attributes}"));
    }

    /// Adds a path.
    pub(super) fn path(&mut self, data: &str, attributes: &str) {
        self.raw(&format!("<path d=\"{data}\" {attributes}/>\n"));
    }

    /// Adds a line of text; `text` is escaped, `attributes` is not.
    pub(super) fn text(
        &mut self,
        at: (f64, f64),
        size: f64,
        anchor: Anchor,
        attributes: &str,
        text: &str,
    ) {
        self.parts.push(Part::Line(Line {
            at,
            size,
            anchor,
            attributes: attributes.to_owned(),
            text: text.to_owned(),
        }));
    }

    /// Adds SVG markup.
    pub(super) fn raw(&mut self, text: &str) {
        self.parts.push(Part::Markup(text.to_owned()));
    }

    /// Returns the SVG, with lines of text as elements.
    #[must_use]
    pub(crate) fn finish(&self) -> String {
        self.with_lines(Line::element)
    }

    /// Returns the SVG, with lines of text written by `element`.
    pub(super) fn with_lines(&self, element: impl Fn(&Line) -> String) -> String {
        let text = |part: &Part| match part {
            Part::Markup(text) => text.clone(),
            Part::Line(line) => element(line),
        };
        let parts = self.parts.iter().map(text);
        parts.chain(["</svg>\n".to_owned()]).collect()
    }
}

impl Line {
    fn element(&self) -> String {
        let anchor = match self.anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let ((x, y), size, attributes) = (self.at, self.size, &self.attributes);
        let (x, y, text) = (px(x), px(y), escape(&self.text));
        format!(
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\" text-anchor=\"{anchor}\" {attributes}>{text}</text>\n"
        )
    }
}

/// Formats a length in units of the drawing, to a hundredth.
#[must_use]
pub(super) fn px(value: f64) -> String {
    let mut text = format!("{value:.2}");
    let kept = text.trim_end_matches('0').trim_end_matches('.').len();
    text.truncate(kept);
    if text == "-0" { "0".to_owned() } else { text }
}

/// Returns the path through points.
#[must_use]
pub(super) fn polyline(points: impl IntoIterator<Item = (f64, f64)>, closed: bool) -> String {
    let mut data = String::new();
    for (index, (x, y)) in points.into_iter().enumerate() {
        let command = if index == 0 { 'M' } else { 'L' };
        // Writing to a string cannot fail.
        let _ = write!(data, "{command}{} {}", px(x), px(y));
    }
    if closed {
        data.push('Z');
    }
    data
}

/// Returns the path of closed curves, to a tenth, without points within `tolerance` of the simplified curve.
#[must_use]
pub(super) fn curves(loops: impl IntoIterator<Item = Vec<(f64, f64)>>, tolerance: f64) -> String {
    let tenths = |(x, y): (f64, f64)| [(10.0 * x).round() as i64, (10.0 * y).round() as i64];
    let mut data = String::new();
    for points in loops {
        let Some(&first) = points.first() else {
            continue;
        };
        let mut kept = vec![first];
        // The point farthest from the first divides a closed curve into two open ones.
        let far = |at: &(f64, f64)| (at.0 - first.0).hypot(at.1 - first.1);
        let middle = (0..points.len())
            .max_by(|a, b| far(&points[*a]).total_cmp(&far(&points[*b])))
            .unwrap_or(0);
        simplify(&points[..=middle], tolerance, &mut kept);
        let back: Vec<(f64, f64)> = points[middle..].iter().copied().chain([first]).collect();
        simplify(&back, tolerance, &mut kept);
        let [mut x, mut y] = tenths(first);
        let mut steps = String::new();
        for point in &kept[1..kept.len() - 1] {
            let [to_x, to_y] = tenths(*point);
            if (to_x, to_y) != (x, y) {
                let _ = write!(steps, "{}{}", step(to_x - x), step(to_y - y));
                (x, y) = (to_x, to_y);
            }
        }
        if !steps.is_empty() {
            let [x, y] = tenths(first);
            let _ = write!(
                data,
                "M{}{}l{}z",
                step(x).trim_start(),
                step(y),
                steps.trim_start()
            );
        }
    }
    data
}

/// Formats a number in tenths, with a separator from the number before.
fn step(tenths: i64) -> String {
    let sign = if tenths < 0 { "-" } else { " " };
    let (whole, rest) = (tenths.abs() / 10, tenths.abs() % 10);
    match (whole, rest) {
        (whole, 0) => format!("{sign}{whole}"),
        (0, rest) => format!("{sign}.{rest}"),
        (whole, rest) => format!("{sign}{whole}.{rest}"),
    }
}

/// Adds the points after the first, simplified within the tolerance (D. H. Douglas and T. K. Peucker, 1973).
fn simplify(points: &[(f64, f64)], tolerance: f64, kept: &mut Vec<(f64, f64)>) {
    let (Some(&from), Some(&to)) = (points.first(), points.last()) else {
        return;
    };
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length = dx.hypot(dy).max(f64::MIN_POSITIVE);
    let away = |at: &(f64, f64)| ((at.0 - from.0) * dy - (at.1 - from.1) * dx).abs() / length;
    let farthest = (1..points.len().saturating_sub(1))
        .max_by(|a, b| away(&points[*a]).total_cmp(&away(&points[*b])));
    match farthest {
        Some(middle) if away(&points[middle]) > tolerance => {
            simplify(&points[..=middle], tolerance, kept);
            simplify(&points[middle..], tolerance, kept);
        }
        _ => kept.push(to),
    }
}

/// Escapes text as XML character data. Characters that XML does not allow, control characters, and marks that change the direction of
/// text are replaced by U+FFFD.
#[must_use]
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\t' | '\n' | '\r' => out.push(' '),
            '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{fffe}' | '\u{ffff}' => {
                out.push('\u{fffd}');
            }
            c if c.is_control() => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// Truncates a text to `most` characters, with an ellipsis.
#[must_use]
pub(super) fn shorten(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    let kept: String = text.chars().take(most.saturating_sub(1)).collect();
    kept.trim_end().to_owned() + "…"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_become_markup() {
        let evil = "</text><script>alert('1')</script>&\"\u{0}\u{8}\u{202e}\n";
        let safe = escape(evil);
        assert!(!safe.contains(['<', '>', '"', '\'', '\u{0}', '\u{8}', '\u{202e}', '\n']));
        assert_eq!(escape("R₁ < 300 & µ = 0.3"), "R₁ &lt; 300 &amp; µ = 0.3");
    }

    #[test]
    fn lengths_have_two_digits_at_most() {
        for (value, text) in [(1.0, "1"), (-0.001, "0"), (12.345, "12.35"), (100.0, "100")] {
            assert_eq!(px(value), text);
        }
    }

    #[test]
    fn curves_keep_their_corners_and_lose_what_lies_between() {
        let square = [
            (0.0, 0.0),
            (5.0, 0.01),
            (10.0, 0.0),
            (10.0, 10.0),
            (4.0, 10.0),
            (0.0, 10.0),
        ];
        assert_eq!(curves([square.to_vec()], 0.1), "M0 0l10 0 0 10-10 0z");
        let dot = vec![(1.0, 1.0), (1.01, 1.0), (1.0, 1.01)];
        assert_eq!(curves([dot, Vec::new()], 0.1), "");
        assert_eq!(
            curves([vec![(0.5, 1.0), (0.0, 2.5), (-0.4, 1.0)]], 0.1),
            "M.5 1l-.5 1.5-.4-1.5z"
        );
    }

    #[test]
    fn long_texts_are_cut_between_characters() {
        assert_eq!(shorten("äöüß", 4), "äöüß");
        assert_eq!(shorten("äöüßx", 4), "äöü…");
    }
}
