//! Fourier transforms of rows and columns of a grid, in single or double width.

use std::cell::RefCell;
use std::sync::Arc;

use realfft::{ComplexToReal, FftNum, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftPlanner};

/// A width of numbers in which transforms are done.
pub trait Width: FftNum + Into<f64> {
    /// The nearest number of this width.
    fn of(value: f64) -> Self;
    /// Plans for a padded grid of `width` by `height`; those of the same thread share what they can.
    fn plans(width: usize, height: usize) -> Plans<Self>;
}

/// How rows and columns are transformed.
pub struct Plans<T> {
    pub(crate) forward: Arc<dyn RealToComplex<T>>,
    pub(crate) backward: Arc<dyn ComplexToReal<T>>,
    pub(crate) columns_forward: Arc<dyn Fft<T>>,
    pub(crate) columns_backward: Arc<dyn Fft<T>>,
}

/// Planners of one thread: there are few padded sizes, and their plans cost as much as several products.
struct Planners<T: FftNum> {
    real: RealFftPlanner<T>,
    complex: FftPlanner<T>,
}

impl<T: FftNum> Planners<T> {
    fn new() -> Self {
        Planners {
            real: RealFftPlanner::new(),
            complex: FftPlanner::new(),
        }
    }

    fn plans(&mut self, width: usize, height: usize) -> Plans<T> {
        Plans {
            forward: self.real.plan_fft_forward(width),
            backward: self.real.plan_fft_inverse(width),
            columns_forward: self.complex.plan_fft_forward(height),
            columns_backward: self.complex.plan_fft_inverse(height),
        }
    }
}

macro_rules! width {
    ($float:ty, $planners:ident) => {
        thread_local! {
            static $planners: RefCell<Planners<$float>> = RefCell::new(Planners::new());
        }

        impl Width for $float {
            fn of(value: f64) -> Self {
                value as $float
            }

            fn plans(width: usize, height: usize) -> Plans<Self> {
                $planners.with_borrow_mut(|planners| planners.plans(width, height))
            }
        }
    };
}

width!(f32, SINGLE);
width!(f64, DOUBLE);
