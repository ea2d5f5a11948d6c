//! What is asked of the stresses below the surface.

/// Which body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoadedBody {
    /// Body 2, the rail: z up is out of it.
    Lower,
    /// Body 1, the wheel: z up is into it.
    Upper,
}

/// Where stresses are asked for.
#[derive(Debug, Clone, PartialEq)]
pub enum StressPlaces {
    /// At `[x, y, depth]` in mm.
    Points(Vec<[f64; 3]>),
    /// At these depths in mm below the worst point of every patch.
    BelowWorst(Vec<f64>),
}

impl StressPlaces {
    /// Number of points.
    #[must_use]
    pub fn count(&self) -> usize {
        match self {
            StressPlaces::Points(points) => points.len(),
            StressPlaces::BelowWorst(depths) => depths.len(),
        }
    }
}

/// What is asked of the stresses below the surface of one body.
#[derive(Debug, Clone, PartialEq)]
pub struct SubsurfaceTask {
    /// Where.
    pub places: StressPlaces,
    /// In which body.
    pub body: LoadedBody,
    /// Poisson's ratio of that body.
    pub poisson_ratio: f64,
    /// Is the worst point of every patch to be found?
    pub worst: bool,
    /// What is judged of a passage of the contact, if anything.
    pub passage: Option<PassageTask>,
}

/// What is judged of a passage of the contact: shakedown always.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassageTask {
    /// Weight of the hydrostatic stress in Dang Van's criterion; not evaluated without.
    pub dang_van_slope: Option<f64>,
}
