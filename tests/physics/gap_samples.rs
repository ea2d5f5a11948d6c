//! Gaps for the tests: crowns of arcs, powers and bumps, and the reference cases made of them.

use serde::Deserialize;
use serde_json::{Value, json};

use crate::reference::{Converged, read};

/// A gap at x = 0.
#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Across {
    /// `[from, to, radius]` of arcs (curvature 1/radius; the outer arcs extend to infinity). Gap and slope are 0 at y = 0.
    Arcs(Vec<[f64; 3]>),
    /// Coefficients of y² and y⁴.
    Powers([f64; 2]),
    /// The minimum of `(y − y0)²/d + offset`, each given as `[y0, d, offset]`.
    Parabolas(Vec<[f64; 3]>),
}

impl Across {
    pub fn at(&self, y: f64) -> f64 {
        match self {
            Across::Arcs(arcs) => {
                // ∫(y − t)/R(t) dt from 0 to y, arc by arc.
                let last = arcs.len() - 1;
                let part = |k: usize| {
                    let [from, to, radius] = arcs[k];
                    let from = if k == 0 { f64::NEG_INFINITY } else { from };
                    let to = if k == last { f64::INFINITY } else { to };
                    let (low, high) = (from.max(y.min(0.0)), to.min(y.max(0.0)));
                    let at = |t: f64| (y - t).powi(2) / (2.0 * radius);
                    if low < high {
                        (at(low) - at(high)).abs()
                    } else {
                        0.0
                    }
                };
                (0..arcs.len()).map(part).sum()
            }
            Across::Powers([square, fourth]) => square * y * y + fourth * y.powi(4),
            Across::Parabolas(parabolas) => parabolas
                .iter()
                .map(|[y0, d, offset]| (y - y0).powi(2) / d + offset)
                .fold(f64::INFINITY, f64::min),
        }
    }
}

/// Returns `count` values from `low` to `high`, which are exact mirror images if the ends are.
pub fn spread(low: f64, high: f64, count: usize) -> Vec<f64> {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    (0..count)
        .map(|k| middle + half * ((2 * k) as f64 - (count - 1) as f64) / (count - 1) as f64)
        .collect()
}

/// Returns a steel case of a gap with μ = 0.3.
pub fn steel(contact: Value, load: Value, motion: [f64; 3]) -> Value {
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": contact,
        "load": load,
        "motion": { "creepage_x": motion[0], "creepage_y": motion[1], "spin_per_mm": motion[2] },
    })
}

/// Returns a profile sampled on `y`.
pub fn profile(rolling: f64, y: &[f64], mut across: impl FnMut(f64) -> f64) -> Value {
    let gap: Vec<f64> = y.iter().map(|y| across(*y)).collect();
    json!({ "type": "gap_profile", "rolling_mm": rolling, "y_mm": y, "gap_mm": gap })
}

/// Returns a gap sampled on `x` and `y`.
pub fn grid(x: &[f64], y: &[f64], mut gap: impl FnMut(f64, f64) -> f64) -> Value {
    let rows: Vec<Vec<f64>> = y
        .iter()
        .map(|y| x.iter().map(|x| gap(*x, *y)).collect())
        .collect();
    json!({ "type": "gap_grid", "x_mm": x, "y_mm": y, "gap_mm": rows })
}

/// A reference contact of a gap, with fields and signs as in `tests/data/README.md`.
#[derive(Debug, Clone, Deserialize)]
pub struct GapReference {
    pub id: String,
    pub rolling_mm: Option<f64>,
    pub across: Option<Across>,
    pub window_y_mm: Option<[f64; 2]>,
    pub x_mm: Option<Vec<f64>>,
    pub y_mm: Option<Vec<f64>>,
    pub gap_mm: Option<Vec<Vec<f64>>>,
    pub normal_force_n: f64,
    pub creepage_x: f64,
    pub creepage_y: f64,
    pub spin_per_mm: f64,
    pub approach_mm: Converged,
    pub area_mm2: Converged,
    pub pressure_max_mpa: Converged,
    pub force_x_n: Converged,
    pub force_y_n: Converged,
    pub moment_z_n_mm: Converged,
}

impl GapReference {
    pub fn profiles() -> Vec<GapReference> {
        read("gap_profiles.json")
    }

    pub fn grids() -> Vec<GapReference> {
        read("gap_grids.json")
    }

    pub fn motion(&self) -> [f64; 3] {
        [self.creepage_x, self.creepage_y, self.spin_per_mm]
    }

    /// Returns the gap as a client would give it: profiles with a sample about every 0.1 mm, grids unchanged.
    pub fn contact(&self) -> Value {
        if let (Some(x), Some(y), Some(gap)) = (&self.x_mm, &self.y_mm, &self.gap_mm) {
            return json!({ "type": "gap_grid", "x_mm": x, "y_mm": y, "gap_mm": gap });
        }
        let across = self.across.as_ref().expect("a profile has a gap across");
        let [low, high] = self.window_y_mm.expect("a profile has a window");
        let y = spread(
            low - 2.0,
            high + 2.0,
            1 + ((high - low + 4.0) / 0.1) as usize,
        );
        profile(self.rolling_mm.expect("a radius"), &y, |y| across.at(y))
    }

    /// Returns the case under its load, solved with default settings.
    pub fn case(&self) -> Value {
        let load = json!({ "normal_force_n": self.normal_force_n });
        steel(self.contact(), load, self.motion())
    }
}
