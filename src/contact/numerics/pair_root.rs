//! The root of a monotone function of two variables, without bounds to start from: Broyden's iteration (Broyden 1965), and where that does not
//! settle a search in a search.

use crate::contact::numerics::bracketed_root::{Root, RootExit, find_root};

/// Arguments tried by Broyden's iteration. Chosen by judgement; how much it matters was not measured.
const TRIALS_AT_ONCE: u32 = 14;
/// Longest step of Broyden's iteration. Chosen by judgement; how much it matters was not measured.
const STEP_MAX: f64 = 0.4;
/// Trials in a row without improvement after which Broyden's iteration is given up. Keeps the numbers safe; not tuned.
const WORSE_MAX: u32 = 3;
/// Tolerance of the inner one of two nested searches over that of the outer one, to which the error of the inner one is noise. Chosen by
/// judgement; how much it matters was not measured.
const INNER_TOLERANCE: f64 = 0.3;

/// The result of a search for two arguments.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PairRoot {
    /// The arguments with the smallest values found.
    pub(crate) place: [f64; 2],
    /// How the search ended; that a value kept its sign counts before other reasons.
    pub(crate) exit: RootExit,
}

/// Searches from `start` for two arguments at which both values are 0. Each value must grow with its own argument; where their slopes are
/// about 1, Broyden's iteration needs no others to begin with. `f` returns the values at two arguments and the length below which they
/// count as 0.
///
/// # Errors
/// Those of `f`.
pub(crate) fn find_pair<E>(
    start: [f64; 2],
    mut f: impl FnMut([f64; 2], &mut f64) -> Result<[f64; 2], E>,
) -> Result<PairRoot, E> {
    if let Some(place) = at_once(start, &mut f)? {
        let exit = RootExit::Found;
        return Ok(PairRoot { place, exit });
    }
    one_in_the_other(start, &mut f)
}

/// Broyden's iteration; nothing if it does not settle.
fn at_once<E>(
    start: [f64; 2],
    f: &mut impl FnMut([f64; 2], &mut f64) -> Result<[f64; 2], E>,
) -> Result<Option<[f64; 2]>, E> {
    let mut tolerance = 0.0;
    let (mut place, mut off) = (start, f(start, &mut tolerance)?);
    let mut inverse = [[1.0, 0.0], [0.0, 1.0]];
    let mut worse = 0;
    let mut trials = 0;
    loop {
        if length(off) <= tolerance {
            return Ok(Some(place));
        }
        if trials == TRIALS_AT_ONCE || worse == WORSE_MAX {
            return Ok(None);
        }
        trials += 1;
        let mut step = times(&inverse, off).map(|s| -s);
        let factor = (STEP_MAX / length(step)).min(1.0);
        step = step.map(|s| factor * s);
        let next = [place[0] + step[0], place[1] + step[1]];
        let found = f(next, &mut tolerance)?;
        let change = times(&inverse, [found[0] - off[0], found[1] - off[1]]);
        let denominator = step[0] * change[0] + step[1] * change[1];
        if denominator.abs() > 1e-12 * length(step).powi(2) {
            let row = [0, 1].map(|j| step[0] * inverse[0][j] + step[1] * inverse[1][j]);
            for i in 0..2 {
                for j in 0..2 {
                    inverse[i][j] += (step[i] - change[i]) * row[j] / denominator;
                }
            }
        }
        if length(found) < length(off) {
            (place, off, worse) = (next, found, 0);
        } else {
            worse += 1;
        }
    }
}

/// For every trial of the second argument, finds the first that makes the first value 0. Both searches are bracketed: slow but sure.
fn one_in_the_other<E>(
    start: [f64; 2],
    f: &mut impl FnMut([f64; 2], &mut f64) -> Result<[f64; 2], E>,
) -> Result<PairRoot, E> {
    let mut first = start[0];
    // Second argument, the first one found for it, and how that search ended.
    let mut pairs = Vec::new();
    let Root { place, exit } = find_root(start[1], |second, tolerance| {
        let (mut off, mut outer) = ([0.0; 2], 0.0);
        let inner = find_root(first, |at, tolerance| {
            off = f([at, second], &mut outer)?;
            *tolerance = INNER_TOLERANCE * outer;
            Ok::<f64, E>(off[0])
        })?;
        first = inner.place;
        pairs.push((second, inner));
        *tolerance = outer;
        Ok::<f64, E>(off[1])
    })?;
    let inner = pairs.iter().rev().find(|(second, _)| *second == place);
    let (first, exit_inner) = inner.map_or((first, RootExit::Found), |(_, inner)| {
        (inner.place, inner.exit)
    });
    let exits = [exit, exit_inner];
    let kept = exits.into_iter().find(|exit| *exit == RootExit::SignKept);
    let last = if exit.converged() { exit_inner } else { exit };
    Ok(PairRoot {
        place: [first, place],
        exit: kept.unwrap_or(last),
    })
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

fn times(matrix: &[[f64; 2]; 2], [x, y]: [f64; 2]) -> [f64; 2] {
    matrix.map(|[a, b]| a * x + b * y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two forces that a length below 1 shares, as friction does.
    fn shared([x, y]: [f64; 2]) -> [f64; 2] {
        let length = 1.0 + x.hypot(y);
        [x / length, y / length]
    }

    fn search(goal: [f64; 2]) -> (PairRoot, u32) {
        let mut trials = 0;
        let look = |place: [f64; 2], least: &mut f64| {
            trials += 1;
            *least = 1e-9;
            let found = shared(place);
            Ok::<[f64; 2], ()>([found[0] - goal[0], found[1] - goal[1]])
        };
        let root = find_pair([0.1, 0.1], look).unwrap();
        (root, trials)
    }

    #[test]
    fn near_arguments_are_found_in_few_trials_and_far_ones_all_the_same() {
        for (place, most) in [([0.3, 0.2], 12), ([-0.4, 0.9], 15), ([8.0, -11.0], 400)] {
            let (root, trials) = search(shared(place));
            assert_eq!(root.exit, RootExit::Found, "{place:?}");
            assert!(trials <= most, "{place:?}: {trials}");
            for (found, wanted) in root.place.iter().zip(place) {
                assert!((found - wanted).abs() < 1e-5, "{root:?}");
            }
        }
    }

    #[test]
    fn values_beyond_what_the_function_reaches_keep_their_sign() {
        let (root, _) = search([0.9, 0.9]);
        assert_eq!(root.exit, RootExit::SignKept, "{root:?}");
    }
}
