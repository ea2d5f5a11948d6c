//! What a picture is asked for, and the words that stand on it.

use serde::Serialize;
use utoipa::ToSchema;

use crate::contact::case::words::solver::Output;
use crate::contact::solution::words::answer::PointSolution;
use crate::jobs::model::names;

/// What a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum View {
    /// One patch from above.
    Patch,
    /// Forces over the motions.
    Curve,
    /// Traction and friction's bound along and across, through the largest traction of a patch.
    Section,
    /// The patches on wheel and rail; of `profiles`.
    Profiles,
}

names! {
    pub(crate) View {
        Patch = "patch",
        Curve = "curve",
        Section = "section",
        Profiles = "profiles",
    }
}

/// What a picture shows, and how wide it is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlotOptions {
    /// What is drawn.
    pub view: View,
    /// The field.
    pub shown: Output,
    /// Number of the patch.
    pub patch: usize,
    /// Number of the motion.
    pub point: usize,
    /// Width in pixels.
    pub width: u32,
    /// Both ends of the scale, if they are given.
    pub range: Option<[f64; 2]>,
}

/// Which patch and motion this is, where there are several.
pub(crate) fn counted(wish: PlotOptions, patches: usize, points: usize) -> String {
    let mut text = String::new();
    if patches > 1 {
        text += &format!(", patch {} of 0 to {}", wish.patch, patches - 1);
    }
    if points > 1 {
        text += &format!(", point {} of 0 to {}", wish.point, points - 1);
    }
    text
}

/// Motion and forces in two lines.
pub(crate) fn remarks(point: &PointSolution, normal: f64, counted: &str) -> Vec<String> {
    let motion = point.motion;
    // What rounding leaves of a force that is nothing.
    let force = |value: f64| {
        let lost = value.abs() < 1e-9 * normal;
        short(if lost { 0.0 } else { value })
    };
    vec![
        format!(
            "creepage x {}, y {}, spin {} 1/mm{counted}",
            short(motion.creepage_x),
            short(motion.creepage_y),
            short(motion.spin_per_mm),
        ),
        format!(
            "normal force {} N; on the lower body: force x {} N, y {} N, moment {} N·mm",
            short(normal),
            force(point.force_x_n),
            force(point.force_y_n),
            force(point.moment_z_n_mm)
        ),
    ]
}

/// A number with four digits that count.
pub(crate) fn short(value: f64) -> String {
    let size = value.abs();
    let text = if size == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e4).contains(&size) {
        let digits = (3.0 - size.log10().floor()).clamp(0.0, 6.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "from 0 to 6"
        )]
        let text = format!("{value:.*}", digits as usize);
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        }
    } else if (1e4..1e9).contains(&size) {
        format!("{value:.0}")
    } else {
        let text = format!("{value:.3e}");
        let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let digits = digits.trim_end_matches('0').trim_end_matches('.');
        format!("{digits}e{exponent}")
    };
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (0.001, "0.001"),
            (-0.0004, "−4e−4"),
            (1.25e-12, "1.25e−12"),
            (100_000.0, "100000"),
            (1234.56, "1235"),
            (12.3456, "12.35"),
            (-3.0, "−3"),
        ] {
            assert_eq!(short(value), text);
        }
    }
}
