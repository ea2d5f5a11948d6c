//! Writes SVG text piece by piece. Every text of a client passes through [`escape`].

use std::fmt::Write;

/// Fonts that are looked for, the one that raster pictures are made with first.
pub const FONTS: &str = "DejaVu Sans, Verdana, sans-serif";

/// A drawing in the making.
#[derive(Debug, Default)]
pub struct Svg {
    text: String,
}

/// Which end of a text stands at its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// The beginning.
    Start,
    /// The middle.
    Middle,
    /// The end.
    End,
}

impl Svg {
    /// Adds an element without content; `attributes` is written as it stands.
    pub fn element(&mut self, name: &str, attributes: &str) {
        self.raw(&format!("<{name} {attributes}/>\n"));
    }

    /// Adds a path.
    pub fn path(&mut self, data: &str, attributes: &str) {
        self.raw(&format!("<path d=\"{data}\" {attributes}/>\n"));
    }

    /// Adds a line of text of the given size; `attributes` is written as it stands, `text` is escaped.
    pub fn text(
        &mut self,
        (x, y): (f64, f64),
        size: f64,
        anchor: Anchor,
        attributes: &str,
        text: &str,
    ) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let (x, y, text) = (px(x), px(y), escape(text));
        self.raw(&format!(
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\" text-anchor=\"{anchor}\" {attributes}>{text}</text>\n"
        ));
    }

    /// Adds text that is SVG already.
    pub fn raw(&mut self, text: &str) {
        self.text.push_str(text);
    }

    /// The drawing so far.
    #[must_use]
    pub fn finish(self) -> String {
        self.text
    }
}

/// A length in the units of the drawing, to a hundredth.
#[must_use]
pub fn px(value: f64) -> String {
    let mut text = format!("{value:.2}");
    let kept = text.trim_end_matches('0').trim_end_matches('.').len();
    text.truncate(kept);
    if text == "-0" { "0".to_owned() } else { text }
}

/// A path through points; closed ones return to their beginning.
#[must_use]
pub fn polyline(points: impl IntoIterator<Item = (f64, f64)>, closed: bool) -> String {
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

/// Text as XML character data. What XML cannot hold, other control characters, and marks that turn the direction of the text
/// beyond its end are replaced by U+FFFD.
#[must_use]
pub fn escape(text: &str) -> String {
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

/// At most `most` characters; a text that is cut ends in an ellipsis.
#[must_use]
pub fn shorten(text: &str, most: usize) -> String {
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
    fn long_texts_are_cut_between_characters() {
        assert_eq!(shorten("äöüß", 4), "äöüß");
        assert_eq!(shorten("äöüßx", 4), "äöü…");
    }
}
