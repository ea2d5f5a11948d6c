//! The maximum of a function of one variable.

/// Maximum of a unimodal function in an interval, by parabolic interpolation and golden sections (Brent 1973). The argument is
/// found to 1e-4 of the interval, so that the relative error of a smooth maximum is about the square of this. A function with several
/// maxima gives one of them. At most forty evaluations.
pub(crate) fn maximum([mut low, mut high]: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    const STEPS: usize = 40;
    const SHORT: f64 = 0.381_966_011_250_105_1;
    let close = 1e-4 * (high - low);
    let best = low + SHORT * (high - low);
    // The best argument, the second best and the previous second best, each with its value.
    let mut places = [(best, f(best)); 3];
    let (mut step, mut before) = (0.0_f64, 0.0_f64);
    for _ in 0..STEPS {
        let [(x, fx), (w, fw), (v, fv)] = places;
        let middle = 0.5 * (low + high);
        if (x - middle).abs() <= 2.0 * close - 0.5 * (high - low) {
            break;
        }
        let (r, q) = ((x - w) * (fx - fv), (x - v) * (fx - fw));
        let parabola = ((x - w) * r - (x - v) * q) / (2.0 * (q - r));
        let inside = parabola > low - x && parabola < high - x;
        if inside && parabola.abs() < 0.5 * before.abs() {
            (before, step) = (step, parabola);
        } else {
            before = if x < middle { high - x } else { low - x };
            step = SHORT * before;
        }
        let at = x + step.abs().max(close).copysign(step);
        let value = f(at);
        if value >= fx {
            *(if at >= x { &mut low } else { &mut high }) = x;
            places = [(at, value), (x, fx), (w, fw)];
            continue;
        }
        *(if at < x { &mut low } else { &mut high }) = at;
        if value >= fw || w == x {
            places = [(x, fx), (at, value), (w, fw)];
        } else if value >= fv || v == x || v == w {
            places[2] = (at, value);
        }
    }
    places[0].1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_top_of_a_hump_is_found_in_few_evaluations() {
        let humps: [(&dyn Fn(f64) -> f64, f64); 3] = [
            (&|x: f64| 1.0 - (x - 0.3).powi(2), 1.0),
            (&|x: f64| (x - 1.2).cos() * (1.0 + 1e-3 * x), 0.0),
            (&|x: f64| -(x - 0.77).abs(), 0.0),
        ];
        for (k, (hump, top)) in humps.into_iter().enumerate() {
            let evaluations = std::cell::Cell::new(0);
            let counted = |x: f64| {
                evaluations.set(evaluations.get() + 1);
                hump(x)
            };
            let found = maximum([-0.5, 2.0], counted);
            let exact = if k == 1 {
                (0..=250_000)
                    .map(|n| hump(-0.5 + 1e-5 * f64::from(n)))
                    .fold(f64::MIN, f64::max)
            } else {
                top
            };
            // At a kink the error of the value is proportional to that of the argument.
            let allowed = if k == 2 { 5e-4 } else { 1e-7 };
            assert!((found - exact).abs() < allowed, "{k}: {found} {exact}");
            assert!(
                evaluations.get() <= 25,
                "{k}: {} evaluations",
                evaluations.get()
            );
        }
    }
}
