//! Colours: a scale whose lightness rises evenly, so that it is readable without colour, and two colours for zones.

/// Number of nodes of the scale.
pub(super) const VIRIDIS_PLACES: usize = 17;

/// The map viridis (S. van der Walt, N. Smith and E. Firing 2015, CC0) at 17 equidistant nodes; linear in between.
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

/// Colour of cells that stick.
pub(super) const STICK: &str = "#31688e";
/// Colour of cells that slip, much lighter, so that both are distinct without colour.
pub(super) const SLIP: &str = "#fde725";

/// Returns the colour at a position on the scale from 0 to 1, as `#rrggbb`.
#[must_use]
pub(super) fn at(share: f64) -> String {
    let [r, g, b] = rgb(share);
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn rgb(share: f64) -> [u8; 3] {
    let last = VIRIDIS_PLACES - 1;
    let place = share.clamp(0.0, 1.0) * last as f64;
    let span = (place as usize).min(last - 1);
    let share = place - span as f64;
    std::array::from_fn(|part| {
        let [from, to] = [VIRIDIS[span][part], VIRIDIS[span + 1][part]].map(f64::from);
        (from + share * (to - from)).round() as u8
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
        let shares = (0..=128).map(|step| f64::from(step) / 128.0);
        let lights: Vec<f64> = shares.map(|share| lightness(rgb(share))).collect();
        let (first, last) = (lights[0], lights[128]);
        assert!(first < 20.0 && last > 88.0, "from {first} to {last}");
        for (level, light) in lights.iter().enumerate() {
            let even = first + (last - first) * level as f64 / 128.0;
            assert!(
                (light - even).abs() < 2.0,
                "step {level}: {light}, not {even}"
            );
        }
        assert!(lights.is_sorted_by(|a, b| a <= b));
    }

    #[test]
    fn values_are_brought_onto_the_ramp() {
        for (share, colour) in [
            (0.0, "#440154"),
            (1.0, "#fde725"),
            (-3.0, "#440154"),
            (7.0, "#fde725"),
        ] {
            assert_eq!(at(share), colour, "{share}");
        }
    }
}
