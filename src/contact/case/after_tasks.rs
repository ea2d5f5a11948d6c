//! From the members of a case to the outputs that follow from the solved contact: stresses below the surface, damage and temperatures.

use crate::case::solver::Limits;
use crate::case::words::material::Material;
use crate::case::words::motion::Motions;
use crate::case::words::solver::{Case, Output};
use crate::case::words::subsurface::{
    BodyName, DepthLineAt, FoundPlace, GridAxis, StressGrid, Subsurface,
};
use crate::error::Fault;
use crate::post::damage::DamageTask;
use crate::post::subsurface::states::{StressPlaces, SubsurfaceTask};
use crate::problem::physics::AfterTasks;

impl AfterTasks {
    /// Returns the requested outputs of a case.
    pub(crate) fn new(case: &Case) -> AfterTasks {
        let subsurface = case.subsurface.as_ref();
        AfterTasks {
            subsurface: subsurface.map(|words| task(words, &case.material)),
            damage: case.damage.as_ref().map(DamageTask::new),
            thermal: case
                .thermal
                .filter(|_| case.outputs.contains(&Output::Temperature)),
        }
    }
}

/// Returns the number of points at which stresses are computed for each motion.
pub(crate) fn count(words: &Subsurface) -> usize {
    let grid = |grid: &StressGrid| {
        let sides = [&grid.x_mm, &grid.y_mm, &grid.depths_mm];
        let counts = sides.map(GridAxis::count);
        counts.into_iter().fold(1, usize::saturating_mul)
    };
    let points = words.points_mm.as_ref().map(Vec::len);
    let depths = words.depths_mm.as_ref().map(Vec::len);
    let grid = words.plane.as_ref().map(grid);
    points.or(depths).or(grid).unwrap_or(0)
}

/// Returns the faults of stresses at too many points, or of a passage together with a history.
pub(crate) fn faults(
    words: &Subsurface,
    motion: &Motions,
    motions: usize,
    limits: &Limits,
) -> Vec<Fault> {
    let mut faults = Vec::new();
    let (count, most) = (count(words).saturating_mul(motions), limits.samples_max);
    if count > most {
        let detail = format!(
            "{count} points over all motions given; at most {most} are allowed in one case"
        );
        faults.push(Fault::new("/subsurface", detail));
    }
    if matches!(motion, Motions::History { .. }) && words.passage.is_some() {
        let detail = "given with a history; a passage is judged in steady rolling only";
        faults.push(Fault::new("/subsurface/passage", detail));
    }
    faults
}

/// Returns where and in which body stresses are computed.
fn task(words: &Subsurface, material: &Material) -> SubsurfaceTask {
    let [lower, upper] = material.bodies();
    let elastic = match words.body {
        BodyName::Lower => lower,
        BodyName::Upper => upper,
    };
    SubsurfaceTask {
        places: places(words),
        body: words.body,
        poisson_ratio: elastic.poisson_ratio,
        worst: words.worst,
        passage: words.passage,
    }
}

fn places(words: &Subsurface) -> StressPlaces {
    let depths = words.depths_mm.as_deref().unwrap_or_default();
    if let Some(points) = &words.points_mm {
        return StressPlaces::Points(points.clone());
    }
    if let Some(grid) = &words.plane {
        let [xs, ys] = [&grid.x_mm, &grid.y_mm].map(GridAxis::values);
        let mut points = Vec::with_capacity(count(words));
        for depth in grid.depths_mm.values() {
            for y in &ys {
                points.extend(xs.iter().map(|x| [*x, *y, depth]));
            }
        }
        return StressPlaces::Points(points);
    }
    match words.along_depth_at_mm {
        Some(DepthLineAt::Place([x, y])) => {
            StressPlaces::Points(depths.iter().map(|depth| [x, y, *depth]).collect())
        }
        Some(DepthLineAt::Found(FoundPlace::Worst)) => StressPlaces::BelowWorst(depths.to_vec()),
        None => StressPlaces::Points(Vec::new()),
    }
}

impl GridAxis {
    /// The number of coordinates.
    fn count(&self) -> usize {
        match self {
            GridAxis::One(_) => 1,
            GridAxis::List(list) => list.len(),
            GridAxis::Spaced { points, .. } => *points as usize,
        }
    }

    /// Returns the coordinates.
    fn values(&self) -> Vec<f64> {
        match self {
            GridAxis::One(value) => vec![*value],
            GridAxis::List(list) => list.clone(),
            GridAxis::Spaced { from, to, points } => {
                let last = f64::from(points.saturating_sub(1).max(1));
                let at = |k: u32| from + (to - from) * (f64::from(k) / last);
                (0..*points).map(at).collect()
            }
        }
    }
}
