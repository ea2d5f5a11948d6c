//! SIMD level of the kernels: the best that the processor has, or a lower one for a comparison.

use std::cell::Cell;
use std::fmt::{self, Display, Formatter};

use pulp::{Arch, WithSimd};

thread_local! {
    /// Level that [`SimdLevel::during`] has set on this thread.
    static CHOSEN: Cell<Option<Arch>> = const { Cell::new(None) };
}

/// An instruction set that the processor has.
///
/// Levels differ in the width of their sums, and therefore in the last digits of an answer.
#[derive(Debug, Clone, Copy)]
pub struct SimdLevel(Arch);

impl SimdLevel {
    /// All levels of the processor, the lowest first.
    #[must_use]
    pub fn available() -> Vec<SimdLevel> {
        let mut levels = vec![Arch::Scalar];
        #[cfg(target_arch = "x86_64")]
        {
            levels.extend(pulp::x86::V3::try_new().map(Arch::V3));
            levels.extend(pulp::x86::V4::try_new().map(Arch::V4));
        }
        #[cfg(not(target_arch = "x86_64"))]
        if !matches!(Arch::new(), Arch::Scalar) {
            levels.push(Arch::new());
        }
        levels.into_iter().map(SimdLevel).collect()
    }

    /// The level that kernels use on this thread.
    #[must_use]
    pub fn current() -> SimdLevel {
        SimdLevel(CHOSEN.get().unwrap_or_default())
    }

    /// Runs `work` with the kernels of this level on this thread.
    ///
    /// Factorisations and Fourier transforms come from libraries that choose their own instructions.
    pub fn during<R>(self, work: impl FnOnce() -> R) -> R {
        /// Restores the level, also after a panic.
        struct Restore(Option<Arch>);
        impl Drop for Restore {
            fn drop(&mut self) {
                CHOSEN.set(self.0);
            }
        }
        let _restore = Restore(CHOSEN.replace(Some(self.0)));
        work()
    }
}

impl Display for SimdLevel {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let name = format!("{:?}", self.0);
        f.write_str(name.split(['(', ' ']).next().unwrap_or_default())
    }
}

/// Runs a kernel at the level of this thread.
pub(crate) fn dispatch<Kernel: WithSimd>(kernel: Kernel) -> Kernel::Output {
    SimdLevel::current().0.dispatch(kernel)
}

#[cfg(test)]
mod tests {
    use super::SimdLevel;

    #[test]
    fn a_level_holds_during_the_work_and_no_longer() {
        let best = SimdLevel::current().to_string();
        for level in SimdLevel::available() {
            let seen = level.during(|| SimdLevel::current().to_string());
            assert_eq!(seen, level.to_string());
            assert_eq!(SimdLevel::current().to_string(), best);
        }
        let levels = SimdLevel::available();
        assert_eq!(levels.last().map(ToString::to_string), Some(best));
    }
}
