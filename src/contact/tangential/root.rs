//! Where an increasing function of one place is 0: between bounds that are found on the way.

use crate::contact::error::SolveError;

/// The farthest place: a hundred times the creepage at which everything slips by the cubic law.
pub(crate) const PLACE_MAX: f64 = 65.0;
/// Places tried.
const TRIALS_MAX: u32 = 40;

/// Where an increasing function is 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Root {
    /// The place.
    pub(crate) place: f64,
    /// False if the function keeps its sign as far as the farthest place.
    pub(crate) reached: bool,
}

/// Goes from `start` until the sign changes, then between the bounds by the Illinois rule (regula falsi that halves the value of
/// a bound that stays). `f` gives the value at a place and sets the size below which it counts as 0.
pub(crate) fn zero(
    start: f64,
    mut f: impl FnMut(f64, &mut f64) -> Result<f64, SolveError>,
) -> Result<Root, SolveError> {
    let mut tolerance = 0.0;
    let (mut low, mut high): (Option<[f64; 2]>, Option<[f64; 2]>) = (None, None);
    let mut place = start.clamp(-PLACE_MAX, PLACE_MAX);
    let (mut stride, mut last) = (0.0_f64, None::<[f64; 2]>);
    for _ in 0..TRIALS_MAX {
        let value = f(place, &mut tolerance)?;
        if value.abs() <= tolerance {
            break;
        }
        let below = value < 0.0;
        let (mine, other) = if below {
            (&mut low, &mut high)
        } else {
            (&mut high, &mut low)
        };
        let stays = last.is_some_and(|[_, before]| (before < 0.0) == below);
        *mine = Some([place, value]);
        if let (Some([_, value]), true) = (other.as_mut(), stays) {
            *value *= 0.5;
        }
        let slope = last.map(|[at, before]| (value - before) / (place - at));
        last = Some([place, value]);
        if let (Some([p, f]), Some([q, g])) = (low, high) {
            if (q - p).abs() <= 1e-13 * q.abs().max(p.abs()) {
                break;
            }
            place = (p * g - q * f) / (g - f);
            continue;
        }
        if place.abs() >= PLACE_MAX && (place < 0.0) != below {
            return Ok(Root {
                place,
                reached: false,
            });
        }
        // One bound is known: as far as the line through the last two says, but not much farther than before.
        let needed = match slope.filter(|slope| *slope > 0.0) {
            Some(slope) => (value / slope).abs(),
            None => value.abs(),
        };
        stride = if stride == 0.0 {
            needed
        } else {
            needed.min(4.0 * stride)
        };
        let step = if below { stride } else { -stride };
        place = (place + step).clamp(-PLACE_MAX, PLACE_MAX);
    }
    Ok(Root {
        place,
        reached: true,
    })
}
