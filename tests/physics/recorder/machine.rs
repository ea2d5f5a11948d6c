//! Names the arithmetic of a machine. A probe of all operations that may differ decides whether two machines give the same bits.

use faer::Mat;
use faer::prelude::Solve;
use railhead_contact::numerics::simd::SimdLevel;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use crate::recorder::record::Digest;

/// Returns the SIMD level of the kernels, and a digest of results of the C library, a factorisation and a transform.
pub fn arithmetic(level: SimdLevel) -> String {
    let mut digest = Digest::new();
    for index in 0..200 {
        let x = 0.037 + 0.0713 * f64::from(index);
        for value in [
            x.sin(),
            x.cos(),
            x.tan(),
            x.atan(),
            x.ln(),
            (-x).exp(),
            x.powf(0.731),
            x.cbrt(),
            x.hypot(1.7),
            x.tanh(),
            x.asinh(),
            x.atan2(0.9),
        ] {
            digest.word(value.to_bits());
        }
    }
    let n = 250;
    let entry = |i: usize, j: usize| ((i * 7 + j * 13) as f64).sin() + f64::from(i == j) * 9.0;
    let matrix = Mat::from_fn(n, n, entry);
    let right = Mat::from_fn(n, 1, |i, _| (i as f64).cos());
    let solved = matrix.partial_piv_lu().solve(&right);
    let product = &matrix * &matrix;
    for i in 0..n {
        digest.word(solved[(i, 0)].to_bits());
        digest.word(product[(i, n - 1 - i)].to_bits());
    }
    let values = (0..180).map(|i| Complex::new(entry(i, 1) as f32, entry(i, 2) as f32));
    let mut values: Vec<Complex<f32>> = values.collect();
    let transform = FftPlanner::new().plan_fft_forward(values.len());
    transform.process(&mut values);
    for value in values {
        digest.word(f64::from(value.re).to_bits());
        digest.word(f64::from(value.im).to_bits());
    }
    format!("{} {level} {}", std::env::consts::ARCH, digest.text())
}
