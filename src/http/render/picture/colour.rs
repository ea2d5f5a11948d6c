//! Colours: a ramp whose lightness rises evenly, so that it reads the same in print without colour, and two for zones.

/// Places at which the ramp is given; linear in between.
pub(super) const VIRIDIS_PLACES: usize = 17;

/// The map viridis (S. van der Walt, N. Smith and E. Firing 2015, CC0) at 17 even places from 0 to 1; linear in between.
const VIRIDIS: [[u8; 3]; VIRIDIS_PLACES] = [
    [68, 1, 84],
    [72, 24, 106],
    [71, 45, 123],
    [66, 64, 134],
    [59, 82, 139],
    [51, 99, 141],
    [44, 114, 142],
    [38, 130, 142],
    [33, 145, 140],
    [31, 160, 136],
    [40, 174, 128],
    [63, 188, 115],
    [94, 201, 98],
    [132, 212, 75],
    [173, 220, 48],
    [216, 226, 25],
    [253, 231, 37],
];

/// Steps of the ramp.
pub(super) const LEVELS: usize = 128;

/// Cells that stick.
pub(super) const STICK: &str = "#31688e";
/// Cells that slip; much lighter, so that both are told apart without colour.
pub(super) const SLIP: &str = "#fde725";

/// The step of a value from 0 to 1; what lies outside is brought to the ends, NaN to 0.
#[must_use]
pub(super) fn level(value: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "clamped to the steps of the ramp; a NaN becomes 0"
    )]
    {
        ((value.clamp(0.0, 1.0) * LEVELS as f64) as usize).min(LEVELS - 1)
    }
}

/// The colour of a step as `#rrggbb`.
#[must_use]
pub(super) fn ramp(level: usize) -> String {
    let [r, g, b] = rgb(level);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The colour at a share of the ramp from 0 to 1, as `#rrggbb`.
#[must_use]
pub(super) fn at(share: f64) -> String {
    ramp(level(share))
}

fn rgb(level: usize) -> [u8; 3] {
    // Hundredths of the way between two places keep this in whole numbers.
    let spans = VIRIDIS.len() - 1;
    let place = level.min(LEVELS - 1) * spans * 100 / (LEVELS - 1);
    let (span, share) = (place / 100, place % 100);
    let (from, to) = (VIRIDIS[span], VIRIDIS[(span + 1).min(spans)]);
    std::array::from_fn(|part| {
        let mixed = usize::from(from[part]) * (100 - share) + usize::from(to[part]) * share;
        u8::try_from((mixed + 50) / 100).unwrap_or(u8::MAX)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// CIE 1976 lightness of an sRGB colour, 0 to 100.
    fn lightness(rgb: [u8; 3]) -> f64 {
        let linear = rgb.map(|part| {
            let part = f64::from(part) / 255.0;
            if part <= 0.04045 {
                part / 12.92
            } else {
                ((part + 0.055) / 1.055).powf(2.4)
            }
        });
        let y = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
        if y > 0.008_856 {
            116.0 * y.cbrt() - 16.0
        } else {
            903.3 * y
        }
    }

    #[test]
    fn lightness_rises_evenly_along_the_ramp() {
        let lights: Vec<f64> = (0..LEVELS).map(|level| lightness(rgb(level))).collect();
        let (first, last) = (lights[0], lights[LEVELS - 1]);
        assert!(first < 20.0 && last > 88.0, "from {first} to {last}");
        for (level, light) in lights.iter().enumerate() {
            let even = first + (last - first) * level as f64 / (LEVELS - 1) as f64;
            assert!(
                (light - even).abs() < 2.0,
                "step {level}: {light}, not {even}"
            );
        }
        assert!(lights.is_sorted_by(|a, b| a <= b));
    }

    #[test]
    fn values_are_brought_onto_the_ramp() {
        assert_eq!(
            (level(0.0), level(1.0), level(-3.0), level(7.0)),
            (0, 127, 0, 127)
        );
        assert_eq!(level(f64::NAN), 0);
        assert_eq!(ramp(0), "#440154");
        assert_eq!(ramp(LEVELS - 1), "#fde725");
    }
}
