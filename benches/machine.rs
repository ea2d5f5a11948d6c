//! Common to the benches: a clock that ignores other processes, medians, and the unit of machine speed.

#![allow(dead_code, reason = "every bench uses its part")]

use cpu_time::ThreadTime;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor;
use faer::{Mat, Par};

/// Returns the seconds that this thread spends on a core for one call of `work`.
pub fn seconds_of<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let clock = ThreadTime::now();
    let answer = work();
    (clock.elapsed().as_secs_f64(), answer)
}

/// Returns the median of the values, or NaN without values.
pub fn median(values: Vec<f64>) -> f64 {
    quantile(values, 0.5)
}

/// Returns the value below which a share of the values lies, or NaN without values.
pub fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    let place = ((values.len() as f64 * share) as usize).min(last);
    values.get(place).copied().unwrap_or(f64::NAN)
}

/// Returns the seconds of one 500 × 500 f64 LU factorisation in place: the unit of machine speed.
pub fn lu_seconds() -> f64 {
    let n = 500;
    let matrix = Mat::<f64>::from_fn(n, n, |i, j| {
        ((7 * i + 3 * j) as f64).sin() + if i == j { 20.0 } else { 0.0 }
    });
    let mut work = matrix.clone();
    let (mut pivots, mut inverse) = (vec![0usize; n], vec![0usize; n]);
    let mut buffer = MemBuffer::new(factor::lu_in_place_scratch::<usize, f64>(
        n,
        n,
        Par::Seq,
        Default::default(),
    ));
    let once = |_| {
        work.copy_from(&matrix);
        let factorise = || {
            factor::lu_in_place(
                work.as_mut(),
                &mut pivots,
                &mut inverse,
                Par::Seq,
                MemStack::new(&mut buffer),
                Default::default(),
            );
        };
        seconds_of(factorise).0
    };
    median((0..31).map(once).collect())
}
