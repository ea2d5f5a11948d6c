//! The unknowns at which residuals vanish, by Broyden's iteration (Broyden 1965) with limited steps.
//!
//! Each residual must be an increasing function of its own unknown, as a force is of its creepage. A step was then too long if the following residuals point back along
//! it. Unless it reduced the residuals, it is rejected, and a shorter step follows from the same place.

use crate::numerics::ITERATIONS_MAX;
use crate::numerics::roots::ROUNDING;
use crate::remark::list::Remark;

/// Bound of the first step: the length of the residuals that it should remove. It doubles after every accepted step that reached it. Chosen by judgement.
const STRIDE: f64 = 0.5;
/// The inverse derivative along a step grows at most by the reciprocal of this per update, however little the residuals change.
const FLAT: f64 = 0.1;
/// Step length over the tolerance below which residuals outside their tolerance mean a jump.
const JUMP: f64 = 0.01;

/// Residuals at a place.
pub(crate) struct Trial<const N: usize, T> {
    /// The residuals.
    pub(crate) residual: [f64; N],
    /// The length of the residuals that counts as 0.
    pub(crate) tolerance: f64,
    /// Further results of the evaluation, returned with the best trial.
    pub(crate) value: T,
}

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Termination {
    /// The residuals are within their tolerance.
    Converged,
    /// An unknown is at its limit, and the residuals point beyond it.
    AtLimit,
    /// The residuals jump where their sign changes.
    Jump,
    /// The trials were used up.
    TrialsUsedUp,
}

impl Termination {
    /// The reason as a clause for messages.
    pub(crate) fn reason(self) -> &'static str {
        match self {
            Termination::Converged => "the tolerance was met",
            Termination::AtLimit => "no change of sign was found",
            Termination::Jump => "the value jumps where its sign changes",
            Termination::TrialsUsedUp => "the iteration limit was reached",
        }
    }
}

/// The trial with the smallest residuals.
#[derive(Debug)]
pub(crate) struct Equilibrium<const N: usize, T> {
    /// The unknowns.
    pub(crate) place: [f64; N],
    /// Further results of its evaluation.
    pub(crate) value: T,
    /// Length of the residuals.
    pub(crate) residual: f64,
    /// The length that counts as 0.
    pub(crate) tolerance: f64,
    /// How the search ended.
    pub(crate) end: Termination,
}

impl<const N: usize, T> Equilibrium<N, T> {
    /// Whether the tolerance was met.
    pub(crate) fn converged(&self) -> bool {
        self.end == Termination::Converged
    }

    /// The remark on a search that did not converge.
    pub(crate) fn inexact(&self, iteration: &'static str) -> Option<Remark> {
        (!self.converged()).then(|| Remark::IterationInexact {
            iteration,
            reason: self.end.reason(),
            residual: self.residual,
            tolerance: self.tolerance,
        })
    }
}

/// A search, which keeps its derivatives for the next one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Search<const N: usize> {
    /// The change of each unknown that changes its residual by about 1; `None` where the unknown is given.
    scale: [Option<f64>; N],
    /// Largest size of each unknown.
    limit: [f64; N],
    /// Inverse of the derivatives of the residuals by the unknowns over their scale.
    inverse: [[f64; N]; N],
}

impl<const N: usize> Search<N> {
    /// A search whose first derivatives follow from the scale.
    pub(crate) fn new(scale: [Option<f64>; N], limit: [f64; N]) -> Search<N> {
        Search {
            scale,
            limit,
            inverse: identity(),
        }
    }

    /// Searches from `start` for the unknowns that are not given.
    ///
    /// # Errors
    /// Errors of `f`.
    pub(crate) fn find<T, E>(
        &mut self,
        start: [f64; N],
        mut f: impl FnMut([f64; N]) -> Result<Trial<N, T>, E>,
    ) -> Result<Equilibrium<N, T>, E> {
        let mut place = each(|k| self.within(k, start[k]));
        let first = f(place)?;
        let mut residual = self.searched(first.residual);
        let mut best = Equilibrium {
            place,
            value: first.value,
            residual: length(residual),
            tolerance: first.tolerance,
            end: Termination::TrialsUsedUp,
        };
        let (mut stride, mut rejected) = (STRIDE, 0);
        for _ in 1..ITERATIONS_MAX {
            if best.residual <= best.tolerance {
                break;
            }
            if stride <= JUMP * best.tolerance {
                best.end = Termination::Jump;
                return Ok(best);
            }
            let wanted = times(&self.inverse, residual);
            let mut factor = (stride / length(wanted)).min(1.0);
            let wanted: [f64; N] = each(|k| -self.scale[k].map_or(0.0, |scale| scale * wanted[k]));
            // Scales the step so that all unknowns stay within their limits.
            let room = |k: usize| (self.limit[k] - place[k] * wanted[k].signum()) / wanted[k].abs();
            factor = (0..N).fold(factor, |factor, k| factor.min(room(k)));
            // An unknown is at its limit if the limit leaves almost nothing of its step.
            if factor <= ROUNDING {
                // The residual of an unknown at its limit may point beyond it.
                let beyond =
                    |k: usize| -self.scale[k].unwrap_or(0.0) * residual[k] * place[k] > 0.0;
                if (0..N).any(|k| room(k) <= ROUNDING && beyond(k)) {
                    best.end = Termination::AtLimit;
                    return Ok(best);
                }
                self.inverse = identity();
                continue;
            }
            let next = each(|k| self.within(k, place[k] + factor * wanted[k]));
            let step = each(|k| self.scale[k].map_or(0.0, |s| (next[k] - place[k]) / s));
            let found = f(next)?;
            let off = self.searched(found.residual);
            self.update(step, each(|k| off[k] - residual[k]));
            best.tolerance = found.tolerance;
            let too_long = product(off, step) > 0.0;
            if !too_long || length(off) < length(residual) {
                (place, residual) = (next, off);
                if factor < 1.0 {
                    stride *= 2.0;
                }
                rejected = 0;
            } else {
                stride = 0.5 * length(step);
                rejected += 1;
                // Derivatives that mislead twice in a row are reset to the scale.
                if rejected % 2 == 0 {
                    self.inverse = identity();
                }
            }
            if length(off) <= best.residual {
                best = Equilibrium {
                    place: next,
                    value: found.value,
                    residual: length(off),
                    ..best
                };
            }
        }
        if best.residual <= best.tolerance {
            best.end = Termination::Converged;
        }
        Ok(best)
    }

    /// Broyden's update, for the change of the residuals with a step over the scale.
    fn update(&mut self, step: [f64; N], change: [f64; N]) {
        let mut moved = times(&self.inverse, change);
        let least = FLAT * product(step, step);
        if product(step, moved) < least {
            moved = step.map(|step| FLAT * step);
        }
        let denominator = product(step, moved);
        let row: [f64; N] = each(|j| (0..N).map(|i| step[i] * self.inverse[i][j]).sum());
        self.inverse =
            each(|i| each(|j| self.inverse[i][j] + (step[i] - moved[i]) * row[j] / denominator));
    }

    fn within(&self, k: usize, value: f64) -> f64 {
        value.clamp(-self.limit[k], self.limit[k])
    }

    fn searched(&self, residual: [f64; N]) -> [f64; N] {
        each(|k| self.scale[k].map_or(0.0, |_| residual[k]))
    }
}

fn each<const N: usize, R>(of: impl FnMut(usize) -> R) -> [R; N] {
    std::array::from_fn(of)
}

fn identity<const N: usize>() -> [[f64; N]; N] {
    each(|i| each(|j| f64::from(u8::from(i == j))))
}

fn product<const N: usize>(a: [f64; N], b: [f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn length<const N: usize>(a: [f64; N]) -> f64 {
    product(a, a).sqrt()
}

fn times<const N: usize>(matrix: &[[f64; N]; N], a: [f64; N]) -> [f64; N] {
    matrix.map(|row| product(row, a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::quadrature::{PRIMES, halton};

    const LIMIT: f64 = 65.0;

    /// Searches for one unknown; also returns all trials.
    fn root(tolerance: f64, f: impl Fn(f64) -> f64) -> (Equilibrium<1, ()>, Vec<[f64; 2]>) {
        let mut seen = Vec::new();
        let found = Search::new([Some(1.0)], [LIMIT]).find([0.1], |[at]| {
            seen.push([at, f(at)]);
            Ok::<_, ()>(Trial {
                residual: [f(at)],
                tolerance,
                value: (),
            })
        });
        (found.unwrap(), seen)
    }

    #[test]
    fn a_root_is_found_to_its_tolerance() {
        for goal in [-20.0, -0.3, 0.0, 0.1, 4.0, 60.0] {
            let (found, _) = root(1e-9, |at| (at - goal) * (1.0 + at * at));
            assert!(found.converged(), "{goal} {found:?}");
            assert!((found.place[0] - goal).abs() < 1e-8, "{goal}: {found:?}");
        }
    }

    #[test]
    fn roots_of_forces_near_their_limit_are_found_from_either_side() {
        for goal in [0.5, 0.9, 0.99, 0.999] {
            for start in [0.0, 0.9, 3.0, 10.0] {
                let mut trials = 0;
                let found = Search::new([Some(1.0)], [LIMIT]).find([start], |[at]| {
                    trials += 1;
                    Ok::<_, ()>(Trial {
                        residual: [at.tanh() - goal],
                        tolerance: 1e-6,
                        value: (),
                    })
                });
                let found = found.unwrap();
                assert!(
                    found.converged() && trials <= 25,
                    "{goal} {start} {trials}: {found:?}"
                );
            }
        }
    }

    #[test]
    fn without_convergence_the_trial_with_the_smallest_residual_is_returned() {
        // The value jumps from -1 to 0.2: only arguments beyond the jump are near 0.
        let jump = |at: f64| if at < 2.0 { -1.0 } else { 0.2 + 0.01 * at };
        let (found, seen) = root(1e-9, jump);
        assert!(!found.converged(), "{found:?}");
        let sizes = seen.iter().map(|[_, value]| value.abs());
        let least = sizes.fold(f64::INFINITY, f64::min);
        assert_eq!(found.residual, least);
        assert!(
            seen.iter()
                .any(|[at, value]| *at == found.place[0] && value.abs() == least)
        );
    }

    #[test]
    fn a_search_without_a_root_says_why_it_ended() {
        let end = |f: &dyn Fn(f64) -> f64| root(1e-9, f).0.end;
        assert_eq!(end(&|at| at - 1e3), Termination::AtLimit);
        assert_eq!(end(&|at| at + 1e3), Termination::AtLimit);
        assert_eq!(end(&|_| -1.0), Termination::AtLimit);
        let (jump, _) = root(1e-4, |at: f64| if at < 2.0 { -1.0 } else { 1.0 });
        assert_eq!(jump.end, Termination::Jump, "{jump:?}");
        assert!((jump.place[0] - 2.0).abs() < 1e-3, "{jump:?}");
        assert!(jump.inexact("a search").is_some());
    }

    /// Two forces that a length below 1 shares, as friction does.
    fn shared([x, y]: [f64; 2]) -> [f64; 2] {
        let length = 1.0 + x.hypot(y);
        [x / length, y / length]
    }

    fn pair(goal: [f64; 2]) -> (Equilibrium<2, ()>, u32) {
        let mut trials = 0;
        let found = Search::new([Some(1.0); 2], [LIMIT; 2]).find([0.1, 0.1], |place| {
            trials += 1;
            let found = shared(place);
            Ok::<_, ()>(Trial {
                residual: [found[0] - goal[0], found[1] - goal[1]],
                tolerance: 1e-9,
                value: (),
            })
        });
        (found.unwrap(), trials)
    }

    #[test]
    fn near_arguments_are_found_in_few_trials_and_far_ones_all_the_same() {
        for (place, most) in [([0.3, 0.2], 12), ([-0.4, 0.9], 15), ([8.0, -11.0], 40)] {
            let (found, trials) = pair(shared(place));
            assert!(found.converged(), "{place:?} {found:?}");
            assert!(trials <= most, "{place:?}: {trials}");
            for (found, wanted) in found.place.iter().zip(place) {
                assert!((found - wanted).abs() < 1e-5, "{place:?}");
            }
        }
    }

    #[test]
    fn values_beyond_what_the_function_reaches_end_at_a_limit() {
        for goal in [[0.9, 0.9], [0.6, -0.8]] {
            let (found, trials) = pair(goal);
            assert_eq!(found.end, Termination::AtLimit, "{found:?}");
            assert!(trials < 20, "{trials}");
        }
    }

    /// Two forces that share a limit of 1, turned and stretched against their unknowns, as by spin and by the shape of a patch.
    fn forces(place: [f64; 2], shift: [f64; 2], stretch: [f64; 2], turn: f64) -> [f64; 2] {
        let [x, y] = each(|k| stretch[k] * place[k] + shift[k]);
        let share = x.hypot(y).tanh() / x.hypot(y);
        let (sin, cos) = turn.sin_cos();
        [cos * x - sin * y, sin * x + cos * y].map(|force| share * force)
    }

    #[test]
    fn forces_up_to_their_limit_are_found_however_they_are_coupled() {
        let (mut all, mut most) = (0, 0);
        for k in 1..=500 {
            let share: [f64; 9] = each(|dimension| halton(k, PRIMES[dimension]));
            let between =
                |dimension: usize, least: f64, most: f64| least + (most - least) * share[dimension];
            let size = 0.995 * share[0].cbrt();
            let (sin, cos) = between(1, 0.0, std::f64::consts::TAU).sin_cos();
            let goal = [size * cos, size * sin];
            let shift = [2, 3].map(|k| between(k, -0.3, 0.3));
            let stretch = [4, 5].map(|k| between(k, 0.5, 1.5));
            let start = each(|k| goal[k] + between(6 + k, -0.2, 0.2));
            let turn = between(8, -0.4, 0.4);
            let mut trials = 0;
            let found = Search::new([Some(1.0); 2], [LIMIT; 2]).find(start, |place| {
                trials += 1;
                let found = forces(place, shift, stretch, turn);
                Ok::<_, ()>(Trial {
                    residual: each(|k| found[k] - goal[k]),
                    tolerance: f64::min(1e-5, 1e-2 * (1.0 - size)),
                    value: (),
                })
            });
            let found = found.unwrap();
            assert!(found.converged(), "{k}: {found:?}");
            (all, most) = (all + trials, most.max(trials));
        }
        assert!(all <= 9 * 500 && most <= 30, "{all} {most}");
    }

    #[test]
    fn an_unknown_that_is_given_stays_and_derivatives_are_kept_for_the_next_search() {
        let mut search = Search::new([Some(0.1), None], [LIMIT; 2]);
        let mut trials = [0; 2];
        for (k, goal) in [0.3, 0.31].into_iter().enumerate() {
            let found = search.find([0.0, 0.7], |[x, y]| {
                trials[k] += 1;
                assert_eq!(y, 0.7);
                Ok::<_, ()>(Trial {
                    residual: [3.0 * x - goal, 1.0],
                    tolerance: 1e-12,
                    value: x,
                })
            });
            let found = found.unwrap();
            assert!((found.value - goal / 3.0).abs() < 1e-12, "{found:?}");
        }
        assert!(trials[1] < trials[0], "{trials:?}");
    }
}
