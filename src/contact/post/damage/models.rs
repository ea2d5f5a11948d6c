//! The damage models as functions of one number, and of an interval of it.

use crate::contact::case::words::damage::{ArchardFigures, UsfdFigures, WlrmFigures};
use crate::contact::solution::words::damage::{Ranged, WearRegime};

/// Wear rate in µg per m rolled and mm² of contact, for a power per area `x` in N/mm².
#[must_use]
pub fn usfd_rate(map: &UsfdFigures, x: f64) -> f64 {
    let severe = map.mild_slope * map.mild_until;
    let beyond = map.catastrophic_slope * (x - map.severe_until).max(0.0);
    (map.mild_slope * x).min(severe) + beyond
}

/// The regime of the wear map at a power per area.
#[must_use]
pub fn usfd_regime(map: &UsfdFigures, x: f64) -> WearRegime {
    match x {
        x if x < map.mild_until => WearRegime::Mild,
        x if x < map.severe_until => WearRegime::Severe,
        _ => WearRegime::Catastrophic,
    }
}

/// Archard's coefficient and its regime at a sliding speed in mm/s and a pressure over hardness: the geometric mean of the range, and
/// the range.
#[must_use]
pub fn archard_coefficient(
    map: &ArchardFigures,
    speed: f64,
    pressure: f64,
) -> (WearRegime, Ranged) {
    let [slow, fast] = map.speeds_mm_per_s;
    let (regime, [low, high]) = if pressure > map.seizure_pressure {
        (WearRegime::Seizure, map.seizure)
    } else if speed >= slow && speed <= fast {
        (WearRegime::Severe, map.severe)
    } else {
        (WearRegime::Mild, map.mild)
    };
    let range = Ranged {
        value: (low * high).sqrt(),
        low: Some(low),
        high: Some(high),
    };
    (regime, range)
}

/// Damage of one pass by the Whole Life Rail Model at Tγ in N.
#[must_use]
pub fn wlrm_damage(function: &WlrmFigures, t_gamma: f64) -> f64 {
    let WlrmFigures {
        threshold_n,
        peak_at_n,
        zero_at_n,
        peak,
    } = *function;
    if t_gamma <= threshold_n {
        0.0
    } else if t_gamma <= peak_at_n {
        peak * (t_gamma - threshold_n) / (peak_at_n - threshold_n)
    } else {
        peak * (zero_at_n - t_gamma) / (zero_at_n - peak_at_n)
    }
}

/// A function of a number that is known up to an interval: its value, and the least and the largest over the interval; `turns` are
/// places where the function may turn.
#[must_use]
pub fn over(x: Ranged, turns: &[f64], function: impl Fn(f64) -> f64) -> Ranged {
    let value = function(x.value);
    let (Some(low), Some(high)) = (x.low, x.high) else {
        return Ranged {
            value,
            low: None,
            high: None,
        };
    };
    let inside = turns
        .iter()
        .copied()
        .filter(|turn| *turn > low && *turn < high);
    let values = inside.chain([low, high]).map(function);
    let (least, largest) = values.fold((value, value), |(least, largest), value| {
        (least.min(value), largest.max(value))
    });
    Ranged {
        value,
        low: Some(least),
        high: Some(largest),
    }
}

/// A number with the same error in both directions, not below 0.
#[must_use]
pub fn about(value: f64, error: Option<f64>) -> Ranged {
    Ranged {
        value,
        low: error.map(|error| (value - error).max(0.0)),
        high: error.map(|error| value + error),
    }
}

/// The product of two numbers that are not negative.
#[must_use]
pub fn times(a: Ranged, b: Ranged) -> Ranged {
    let both = |a: Option<f64>, b: Option<f64>| Some(a? * b?);
    Ranged {
        value: a.value * b.value,
        low: both(a.low, b.low),
        high: both(a.high, b.high),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WEAR: UsfdFigures = UsfdFigures {
        mild_slope: 5.3,
        mild_until: 10.4,
        severe_until: 77.2,
        catastrophic_slope: 61.9,
    };
    const FATIGUE: WlrmFigures = WlrmFigures {
        threshold_n: 15.0,
        peak_at_n: 65.0,
        zero_at_n: 175.0,
        peak: 1e-5,
    };

    #[test]
    fn the_wear_map_has_its_three_regimes_and_no_steps() {
        for (x, rate) in [
            (0.0, 0.0),
            (2.0, 10.6),
            (10.4, 55.12),
            (50.0, 55.12),
            (77.2, 55.12),
        ] {
            assert!((usfd_rate(&WEAR, x) - rate).abs() < 1e-12, "{x}");
        }
        // 61.9 x − 4723.56 beyond the second limit.
        assert!((usfd_rate(&WEAR, 100.0) - (6190.0 - 4723.56)).abs() < 1e-9);
        let steps = (0..2000).map(|k| 0.05 * f64::from(k));
        for x in steps {
            assert!(
                usfd_rate(&WEAR, x + 1e-9) - usfd_rate(&WEAR, x) < 1e-6,
                "{x}"
            );
        }
    }

    #[test]
    fn the_damage_function_rises_peaks_and_goes_below_zero() {
        for (t_gamma, damage) in [(15.0, 0.0), (40.0, 5e-6), (65.0, 1e-5), (175.0, 0.0)] {
            assert!(
                (wlrm_damage(&FATIGUE, t_gamma) - damage).abs() < 1e-18,
                "{t_gamma}"
            );
        }
        // Slopes +2e-7 and −9.1e-8 per N.
        assert!((wlrm_damage(&FATIGUE, 16.0) - 2e-7).abs() < 1e-12);
        assert!((wlrm_damage(&FATIGUE, 176.0) + 9.0909e-8).abs() < 1e-11);
    }

    #[test]
    fn an_interval_over_the_peak_has_the_peak_as_its_largest() {
        let t_gamma = about(60.0, Some(20.0));
        let found = over(t_gamma, &[15.0, 65.0], |x| wlrm_damage(&FATIGUE, x));
        assert!((found.high.unwrap() - 1e-5).abs() < 1e-18);
        assert!((found.low.unwrap() - 5e-6).abs() < 1e-18);
        assert!((found.value - 9e-6).abs() < 1e-18);
    }
}
