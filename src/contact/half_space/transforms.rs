//! Fourier transforms of rows and columns of a grid, in single or double width.

use std::sync::Arc;

use realfft::{ComplexToReal, FftNum, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftPlanner};

/// A width of numbers in which transforms are done.
pub trait Width: FftNum + Into<f64> {
    /// The nearest number of this width.
    fn of(value: f64) -> Self;
}

impl Width for f32 {
    fn of(value: f64) -> Self {
        value as f32
    }
}

impl Width for f64 {
    fn of(value: f64) -> Self {
        value
    }
}

/// How rows and columns are transformed.
pub struct Plans<T> {
    pub(crate) forward: Arc<dyn RealToComplex<T>>,
    pub(crate) backward: Arc<dyn ComplexToReal<T>>,
    pub(crate) columns_forward: Arc<dyn Fft<T>>,
    pub(crate) columns_backward: Arc<dyn Fft<T>>,
}

/// Plans made so far. A solve meets few padded sizes, and the plans of one cost 2 µs (64 × 64) to 14 µs (400 × 400), about a tenth
/// of a product, so they are kept for one solve only.
pub struct Planners<T: FftNum> {
    real: RealFftPlanner<T>,
    complex: FftPlanner<T>,
}

impl<T: FftNum> Default for Planners<T> {
    fn default() -> Self {
        Planners {
            real: RealFftPlanner::new(),
            complex: FftPlanner::new(),
        }
    }
}

impl<T: FftNum> Planners<T> {
    /// Plans for a padded grid of `width` by `height`.
    pub fn plans(&mut self, width: usize, height: usize) -> Plans<T> {
        Plans {
            forward: self.real.plan_fft_forward(width),
            backward: self.real.plan_fft_inverse(width),
            columns_forward: self.complex.plan_fft_forward(height),
            columns_backward: self.complex.plan_fft_inverse(height),
        }
    }
}
