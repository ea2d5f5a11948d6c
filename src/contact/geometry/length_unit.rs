//! Units of length in which cross-sections are given.

/// A unit of length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LengthUnit {
    /// Millimetre.
    Mm,
    /// Centimetre.
    Cm,
    /// Metre.
    M,
    /// Inch.
    Inch,
}

/// All units, with their symbol and their length in mm.
const UNITS: [(LengthUnit, &str, f64); 4] = [
    (LengthUnit::Mm, "mm", 1.0),
    (LengthUnit::Cm, "cm", 10.0),
    (LengthUnit::M, "m", 1000.0),
    (LengthUnit::Inch, "inch", 25.4),
];

impl LengthUnit {
    /// Its length in mm.
    #[must_use]
    pub fn mm(self) -> f64 {
        UNITS[self as usize].2
    }

    /// Its symbol.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        UNITS[self as usize].1
    }

    /// The unit that a word of a file names, in any case and possibly in brackets or quotes.
    #[must_use]
    pub fn named(word: &str) -> Option<LengthUnit> {
        let word = word
            .trim_matches(|c: char| !c.is_alphanumeric() && c != '"')
            .to_ascii_lowercase();
        match word.as_str() {
            "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => {
                Some(LengthUnit::Mm)
            }
            "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => {
                Some(LengthUnit::Cm)
            }
            "m" | "meter" | "meters" | "metre" | "metres" => Some(LengthUnit::M),
            "in" | "\"" | "inch" | "inches" => Some(LengthUnit::Inch),
            _ => None,
        }
    }

    /// The unit in which `width` is nearest to a usual width in mm; none if it is far from that in every unit.
    #[must_use]
    pub fn likely(width: f64, usual: f64) -> Option<LengthUnit> {
        // Half of the smallest ratio of two units, cm and inch, so that at most one unit fits.
        let nearest = 25.4_f64.ln() - 10.0_f64.ln();
        UNITS
            .iter()
            .find(|(_, _, mm)| (width * mm / usual).ln().abs() < 0.5 * nearest)
            .map(|(unit, ..)| *unit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_width_has_at_most_one_likely_unit() {
        for (width, usual, unit) in [
            (0.072, 72.0, Some(LengthUnit::M)),
            (7.0, 72.0, Some(LengthUnit::Cm)),
            (2.9, 72.0, Some(LengthUnit::Inch)),
            (5.3, 135.0, Some(LengthUnit::Inch)),
            (13.5, 135.0, Some(LengthUnit::Cm)),
            (60.0, 72.0, Some(LengthUnit::Mm)),
            (400.0, 72.0, None),
        ] {
            assert_eq!(LengthUnit::likely(width, usual), unit, "{width}");
        }
    }

    #[test]
    fn words_of_files_name_units() {
        for (word, unit) in [
            ("[mm]", Some(LengthUnit::Mm)),
            ("'M'", Some(LengthUnit::M)),
            ("Inches", Some(LengthUnit::Inch)),
            ("(cm)", Some(LengthUnit::Cm)),
            ("km", None),
            ("", None),
        ] {
            assert_eq!(LengthUnit::named(word), unit, "{word}");
        }
    }
}
