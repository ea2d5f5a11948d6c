//! Pictures of a result other than that of one patch: creep curves, sections, and the patches on wheel and rail.

use serde_json::Value;
use uuid::Uuid;

use crate::contact::case::words::solver::Output;
use crate::contact::solution::words::answer::{PatchCells, PointSolution, Solution, Total};
use crate::http::extract::query::require_index;
use crate::http::problem::error::ApiError;
use crate::http::render::picture::curve::{self, Curve, CurveLine};
use crate::http::render::picture::profile_view::{self, ProfileView, ProfileViewPatch};
use crate::http::render::picture::section::{self, Sections};
use crate::http::routes::part_request::PartRequest;
use crate::http::routes::plot_words::{PlotOptions, View, counted, remarks, short};
use crate::http::routes::stored_fields::stored;
use crate::jobs::Jobs;
use crate::jobs::error::JobsError;

/// Draws when its turn has come.
pub(crate) type Drawing = Box<dyn FnOnce(u32) -> Result<String, ApiError> + Send>;

/// What draws this view.
///
/// # Errors
/// There is nothing of it to be drawn, or there is no result.
pub(crate) async fn drawing(
    request: &PartRequest,
    title: String,
    wish: PlotOptions,
) -> Result<Drawing, ApiError> {
    let (jobs, id) = (&request.jobs, request.id);
    let solution = jobs.solution(id).await?;
    match wish.view {
        View::Curve => of_curve(title, &solution),
        View::Profiles => of_profiles(jobs, id, title, solution).await,
        View::Section | View::Patch => of_section(jobs, id, title, wish, &solution).await,
    }
}

fn of_curve(title: String, solution: &Solution) -> Result<Drawing, ApiError> {
    let points = solution
        .patches
        .first()
        .map_or(&[][..], |patch| &patch.points);
    if points.len() < 2 {
        return Err(ApiError::bad_parameter(
            "view",
            "the case has one motion; a curve needs several, as of a sweep",
        ));
    }
    let (x_name, x) = varying(points);
    let line = |name, force: fn(&Total) -> [Option<f64>; 2]| CurveLine {
        name,
        y: solution
            .total
            .iter()
            .filter_map(|total| force(total)[0])
            .collect(),
        error: solution.total.iter().map(|total| force(total)[1]).collect(),
    };
    let bounds = solution.patches.iter().map(|patch| patch.friction_limit_n);
    let normal: f64 = solution
        .patches
        .iter()
        .map(|patch| patch.normal_force_n)
        .sum();
    let curve = Curve {
        title,
        remarks: vec![format!(
            "{} motions, normal force {} N",
            points.len(),
            short(normal)
        )],
        x_name: x_name.to_owned(),
        x,
        lines: vec![
            line("force x (along rolling)", |total| {
                [
                    Some(total.force_x_n),
                    total.error_estimate.map(|error| error.force_x_n),
                ]
            }),
            line("force y (across)", |total| {
                [
                    Some(total.force_y_n),
                    total.error_estimate.map(|error| error.force_y_n),
                ]
            }),
        ],
        bound: bounds.sum(),
    };
    Ok(Box::new(move |width| Ok(curve::draw(&curve, width))))
}

/// The component that varies most from motion to motion, measured by what it does to the patch, and its values; of a history the distance.
fn varying(points: &[PointSolution]) -> (&'static str, Vec<f64>) {
    type Component = fn(&PointSolution) -> f64;
    let distance = |point: &PointSolution| Some(point.history?.distance_mm);
    if let Some(distances) = points.iter().map(distance).collect() {
        return ("distance rolled in mm", distances);
    }
    let length = points
        .first()
        .map_or(1.0, |point| point.normalised.length_mm);
    let components: [(&str, f64, Component); 3] = [
        ("creepage x", 1.0, |point| point.motion.creepage_x),
        ("creepage y", 1.0, |point| point.motion.creepage_y),
        ("spin in 1/mm", length, |point| point.motion.spin_per_mm),
    ];
    let spread = |weight: f64, of: Component| {
        let values = points.iter().map(of);
        let most = values.clone().fold(f64::NEG_INFINITY, f64::max);
        weight * (most - values.fold(f64::INFINITY, f64::min))
    };
    let most = components
        .into_iter()
        .max_by(|a, b| spread(a.1, a.2).total_cmp(&spread(b.1, b.2)));
    let (name, _, of) = most.unwrap_or(components[0]);
    (name, points.iter().map(of).collect())
}

async fn of_section(
    jobs: &Jobs,
    id: Uuid,
    title: String,
    wish: PlotOptions,
    solution: &Solution,
) -> Result<Drawing, ApiError> {
    let patches = solution.patches.len();
    require_index("patch", Some(wish.patch), patches)?;
    let patch = &solution.patches[wish.patch];
    require_index("point", Some(wish.point), patch.points.len())?;
    let (cells, values) = stored(jobs, id, wish.patch, wish.point, Output::Tractions).await?;
    let counted = counted(wish, patches, patch.points.len());
    let sections = Sections {
        title,
        remarks: remarks(&patch.points[wish.point], patch.normal_force_n, &counted),
        cells,
        values,
        friction: solution
            .asked
            .as_ref()
            .filter(|asked| !asked.friction_varies)
            .map(|asked| asked.friction_coefficient),
    };
    Ok(Box::new(move |width| Ok(section::draw(&sections, width))))
}

async fn of_profiles(
    jobs: &Jobs,
    id: Uuid,
    title: String,
    solution: Solution,
) -> Result<Drawing, ApiError> {
    let mut patches = Vec::new();
    for (number, patch) in solution.patches.iter().enumerate() {
        // The wheelset has two wheels in every position.
        let Some(position) = patch.position.filter(|_| solution.wheelset.is_none()) else {
            return Err(ApiError::bad_parameter(
                "view",
                "only contacts of the type `profiles` have one wheel and one rail",
            ));
        };
        let cells = match jobs.point_fields(id, number, 0).await {
            Err(JobsError::NoSuchPatch { .. }) => PatchCells::default(),
            fields => fields?.meshes.pop().unwrap_or_default(),
        };
        patches.push(ProfileViewPatch { position, cells });
    }
    let case = jobs.case(id).await?;
    let jobs = jobs.clone();
    Ok(Box::new(move |width| {
        let case: Value =
            serde_json::from_slice(&case).map_err(|error| ApiError::internal(&error))?;
        // It was sound when it was submitted.
        let checked = jobs.check(&case).map_err(ApiError::from)?;
        let understood = checked
            .understood()
            .map_err(|error| ApiError::internal(&error))?;
        let placed = understood
            .placement
            .ok_or_else(|| ApiError::internal(&"a case of profiles without a placement"))?;
        let pressed = match patches
            .iter()
            .any(|patch| patch.cells.pressure_mpa.is_some())
        {
            true => "pressure stands on the rail",
            false => "without `pressure` among its outputs",
        };
        let count = patches.len();
        let view = ProfileView {
            title,
            remarks: vec![
                format!(
                    "{count} {}; {pressed}",
                    if count == 1 { "patch" } else { "patches" }
                ),
                solution
                    .patches
                    .iter()
                    .enumerate()
                    .map(|(number, patch)| {
                        format!(
                            "{number}: {} N, {} MPa",
                            short(patch.normal_force_n),
                            short(patch.pressure_max_mpa)
                        )
                    })
                    .collect::<Vec<_>>()
                    .join("; "),
            ],
            placed,
            lowering: solution.wheel_lowering_mm.unwrap_or(0.0),
            patches,
        };
        Ok(profile_view::draw(&view, width))
    }))
}
