//! Renders a picture as PNG. Text is drawn as outlines of an embedded font, so that it looks the same on all systems.
//!
//! The font is a subset of DejaVu Sans (Latin, Greek, Cyrillic and symbols), with its licence in the same folder.

use std::fmt::Write;

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};
use ttf_parser::{Face, GlyphId, OutlineBuilder};
use unicode_normalization::UnicodeNormalization;

use crate::render::picture::svg::{Anchor, Line, Svg};

const FONT: &[u8] = include_bytes!("DejaVuSans.ttf");

/// Renders a picture, `width` pixels wide.
///
/// # Errors
/// The picture is not valid SVG, or does not fit into memory.
pub(crate) fn png(picture: &Svg, width: u32) -> Result<Vec<u8>, String> {
    let font = Face::parse(FONT, 0).map_err(|error| error.to_string())?;
    let svg = picture.with_lines(|line| outlined(line, &font));
    let tree = Tree::from_str(&svg, &Options::default()).map_err(|error| error.to_string())?;
    let size = tree.size().to_int_size();
    let size = size
        .scale_to_width(width)
        .ok_or("the picture has no size")?;
    let mut pixels = Pixmap::new(size.width(), size.height()).ok_or("the picture is too large")?;
    let scale = width as f32 / tree.size().width();
    resvg::render(
        &tree,
        Transform::from_scale(scale, scale),
        &mut pixels.as_mut(),
    );
    pixels.encode_png().map_err(|error| error.to_string())
}

/// Returns a line of text as a path. A character that the font lacks is an empty box, the glyph 0.
fn outlined(line: &Line, font: &Face) -> String {
    let scale = line.size / f64::from(font.units_per_em());
    // The font has letters with accents as single characters.
    let glyphs = line.text.nfc();
    let glyphs: Vec<(GlyphId, f64)> = glyphs
        .map(|c| font.glyph_index(c).unwrap_or_default())
        .map(|glyph| {
            let advance = font.glyph_hor_advance(glyph).unwrap_or(0);
            (glyph, scale * f64::from(advance))
        })
        .collect();
    let length: f64 = glyphs.iter().map(|(_, advance)| advance).sum();
    let before = match line.anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => 0.5 * length,
        Anchor::End => length,
    };
    let mut outline = Outline {
        data: String::new(),
        at: (line.at.0 - before, line.at.1),
        scale,
    };
    for (glyph, advance) in glyphs {
        // A space has no outline.
        let _ = font.outline_glyph(glyph, &mut outline);
        outline.at.0 += advance;
    }
    let (data, attributes) = (outline.data, &line.attributes);
    format!("<path d=\"{data}\" {attributes}/>\n")
}

/// Path data of glyphs.
struct Outline {
    data: String,
    /// Origin of the current glyph.
    at: (f64, f64),
    /// Units of the picture per unit of the font.
    scale: f64,
}

impl Outline {
    fn add<const N: usize>(&mut self, command: char, points: [(f32, f32); N]) {
        self.data.push(command);
        for (x, y) in points {
            // The second axis of the font points upward. Writing to a string cannot fail.
            let x = self.at.0 + self.scale * f64::from(x);
            let y = self.at.1 - self.scale * f64::from(y);
            let _ = write!(self.data, "{x:.3} {y:.3} ");
        }
    }
}

impl OutlineBuilder for Outline {
    fn move_to(&mut self, x: f32, y: f32) {
        self.add('M', [(x, y)]);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.add('L', [(x, y)]);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.add('Q', [(x1, y1), (x, y)]);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.add('C', [(x1, y1), (x2, y2), (x, y)]);
    }

    fn close(&mut self) {
        self.data.push('Z');
    }
}
