//! Results that follow from a solved motion: stresses below the surface, temperatures, slips and damage.

use crate::case::words::material::Thermal;
use crate::case::words::solver::Output;
use crate::case::words::subsurface::BodyName;
use crate::monitor::{Monitor, Stop};
use crate::normal::hertz::Patch;
use crate::post::damage::{DamagedPatch, across, damage};
use crate::post::local_power::{CellPower, SolvedMotion, cell_power, heating};
use crate::post::subsurface::load_parts::LoadResolution;
use crate::post::subsurface::states::{
    STORED, StressPlaces, SubsurfaceTask, in_patch_axes, point, stored,
};
use crate::post::subsurface::surface_load::{LoadWorkspace, SurfaceLoad};
use crate::post::subsurface::worst::{BelowPatch, DEPTHS, GAP, worst_place};
use crate::post::subsurface::worst_passage::passage as passage_of;
use crate::problem::checked_case::CheckedCase;
use crate::remark::list::Remark;
use crate::solution::words::answer::{PointFields, PointSolution};
use crate::solution::words::evolution::{SubsurfaceSummary, TemperatureSummary};

/// Smallest Péclet number at which heat flows only into the depth (Jaeger 1942). Below it, the computed temperatures are too high.
const PECLET_LEAST: f64 = 10.0;

/// Computes the damage of each patch from its resultants and its friction limit in N.
pub(crate) fn add_damage(
    case: &CheckedCase,
    patches: &[Patch],
    limits: &[f64],
    speed: Option<f64>,
    points: &mut [PointSolution],
) {
    let Some(task) = &case.run.after.damage else {
        return;
    };
    for ((patch, limit), point) in patches.iter().zip(limits).zip(points) {
        let of = DamagedPatch {
            patch,
            point,
            limit: *limit,
            speed,
        };
        point.damage = Some(Box::new(damage(task, of)));
    }
}

/// Computes results from the cells of a motion. Writes summaries to its points and returns the values per cell of each patch, with remarks. In a
/// history, slips are those of the step to the point.
pub(crate) fn add_rest(
    case: &CheckedCase,
    solved: SolvedMotion,
    is_of_history: bool,
    points: &mut [PointSolution],
    monitor: &dyn Monitor,
) -> Result<(Vec<PointFields>, Vec<Remark>), Stop> {
    let run = &case.run;
    let mut kept = vec![PointFields::default(); points.len()];
    let mut slips: Option<[Vec<f64>; 2]> = None;
    if is_of_history {
        let unit = solved.level.scale.slip();
        let scaled = |slips: &Vec<f64>| slips.iter().map(|slip| unit * slip).collect();
        slips = Some(solved.answer.slip.each_ref().map(scaled));
    } else if run.after.needs_power(&run.outputs) {
        let totals: Vec<f64> = points.iter().map(|p| p.friction_power_n).collect();
        let power = cell_power(solved, &totals, monitor)?;
        if let Some(task) = run.after.damage.as_ref().filter(|task| task.across) {
            for (patch, point) in points.iter_mut().enumerate() {
                if let Some(damage) = &mut point.damage {
                    damage.across = Some(across(task, solved, &power, patch));
                }
            }
        }
        if let Some(task) = &run.after.thermal {
            for (k, (point, kept)) in points.iter_mut().zip(&mut kept).enumerate() {
                let (summary, cells) = temperatures(task, solved, &power, k);
                point.temperature = Some(summary);
                kept.temperature_c = Some(cells);
            }
        }
        slips = Some(power.slip);
    }
    if let Some([x, y]) = slips.filter(|_| run.wants(Output::Slip)) {
        for (k, kept) in kept.iter_mut().enumerate() {
            let cells = solved.level.patch_cells(k);
            kept.slip_x = Some(x[cells.clone()].to_vec());
            kept.slip_y = Some(y[cells].to_vec());
        }
    }
    let temperatures = points.iter().filter_map(|point| point.temperature);
    let peclet = temperatures.map(|found| found.peclet).reduce(f64::min);
    let least = PECLET_LEAST;
    let slow = peclet.filter(|peclet| *peclet < least);
    let slow = slow.map(|peclet| Remark::HeatSpreads { peclet, least });
    let mut remarks = Vec::from_iter(slow);
    if let Some(task) = &run.after.subsurface {
        remarks.extend(add_stresses(task, solved, points, &mut kept, monitor)?);
    }
    Ok((kept, remarks))
}

/// Returns the smallest depth of stresses below a patch in mm. Closer to the surface, the steps of the traction between cells distort them. At
/// this depth the largest error in the reference contacts is 0.3 % of the largest pressure
/// (`cargo test --test physics -- stresses_are --nocapture`).
fn least_depth(patch: &Patch) -> f64 {
    let [x_min, x_max, y_min, y_max] = patch.extent;
    DEPTHS[0] * 0.5 * (x_max - x_min).min(y_max - y_min)
}

/// Computes the stresses below each patch and returns a remark on them. All patches of a frame load the same body, so each point has the
/// stresses of all of them.
fn add_stresses(
    task: &SubsurfaceTask,
    of: SolvedMotion,
    points: &mut [PointSolution],
    kept: &mut [PointFields],
    monitor: &dyn Monitor,
) -> Result<Option<Remark>, Stop> {
    // The lower body's normal is up, the upper's down, and tractions on it are the reactions.
    let sign = match task.body {
        BodyName::Lower => 1.0,
        BodyName::Upper => -1.0,
    };
    let load = SurfaceLoad::new(of, sign, task.poisson_ratio);
    let patches = of.footprint.patches();
    let depths = patches.iter().map(least_depth);
    let least = depths.fold(f64::INFINITY, f64::min);
    let workspace = &mut load.workspace();
    let evaluate = |places: &[[f64; 3]], workspace: &mut LoadWorkspace| {
        let mut values = Vec::with_capacity(places.len() * STORED);
        for [x, y, depth] in places {
            monitor.go_on(0.0)?;
            let at = [*x, *y, depth.max(least)];
            let stress = load.stress(at, LoadResolution::FINE, workspace);
            values.extend(stored(at, in_patch_axes(stress, task.body)));
        }
        Ok(values)
    };
    let needs_worst = task.worst || matches!(task.places, StressPlaces::BelowWorst(_));
    let mut gap = 0.0_f64;
    let mut shared: Option<([f64; 2], Vec<f64>)> = None;
    let results = points.iter_mut().zip(kept);
    for ((k, patch), (result, kept)) in patches.iter().enumerate().zip(results) {
        monitor.go_on(0.0)?;
        let below = BelowPatch {
            load: &load,
            footprint: of.footprint,
            patch: k,
            least: least_depth(patch),
        };
        let worst = match needs_worst || task.passage.is_some() {
            true => worst_place(below, workspace),
            false => None,
        };
        let stresses = match (&task.places, worst) {
            (StressPlaces::BelowWorst(depths), Some([x, y, _])) => {
                let line: Vec<[f64; 3]> = depths.iter().map(|depth| [x, y, *depth]).collect();
                evaluate(&line, workspace)?
            }
            (StressPlaces::Points(points), _) => {
                let origin = of.footprint.origin(k);
                match &shared {
                    Some((about, known)) if *about == origin => known.clone(),
                    _ => {
                        let [x0, y0] = origin;
                        let points: Vec<[f64; 3]> = points
                            .iter()
                            .map(|[x, y, depth]| [x0 + x, y0 + y, *depth])
                            .collect();
                        let found = evaluate(&points, workspace)?;
                        shared.insert((origin, found)).1.clone()
                    }
                }
            }
            (StressPlaces::BelowWorst(_), None) => Vec::new(),
        };
        let passage = task.passage.zip(worst);
        let passage = passage.map(|(words, worst)| passage_of(words, below, worst, monitor));
        let passage = passage.transpose()?;
        let worst = worst.filter(|_| needs_worst).map(|at| {
            let stress = load.stress(at, LoadResolution::FINE, workspace);
            point(at, in_patch_axes(stress, task.body))
        });
        gap = gap.max(passage.map_or(0.0, |passage| passage.gap));
        kept.subsurface = Some(stresses);
        result.subsurface = Some(SubsurfaceSummary {
            body: task.body,
            least_depth_mm: least,
            worst,
            passage: passage.map(|passage| passage.summary),
        });
    }
    Ok((gap > GAP).then_some(Remark::IterationInexact {
        iteration: "the smallest ball about the stresses of a passage",
        reason: "the iteration limit was reached",
        residual: gap,
        tolerance: GAP,
    }))
}

/// Returns the temperatures of a patch: their summary, and that of both surfaces at the middle of each cell in °C. All segments of a strip in the
/// patch heat it, and the gaps between them have no heat.
fn temperatures(
    task: &Thermal,
    of: SolvedMotion,
    power: &CellPower,
    patch: usize,
) -> (TemperatureSummary, Vec<f64>) {
    let (level, speed) = (of.level, of.speed.unwrap_or(0.0));
    let unit = match speed > 0.0 {
        true => task.rise_of(speed),
        false => 0.0,
    };
    let base = task.without_heat();
    let mesh = &level.mesh;
    let mut cells = Vec::with_capacity(level.patch_cells(patch).len());
    let mut hottest: Vec<(f64, [f64; 2])> = Vec::new();
    for strip in mesh.strips(patch) {
        let mut edges = vec![mesh.left[strip[0].cells.start]];
        // Heat per area over the rolling speed between the edges, in N/mm².
        let (mut heat, mut middles) = (Vec::new(), Vec::new());
        for segment in strip {
            let start = mesh.left[segment.cells.start];
            if start > edges[edges.len() - 1] {
                edges.push(start);
                heat.push(0.0);
            }
            for i in segment.cells.clone() {
                edges.push(mesh.right[i]);
                heat.push(power.power[i] / level.area[i]);
                middles.push(0.5 * (mesh.left[i] + mesh.right[i]));
            }
        }
        let points = [&middles[..], &edges].concat();
        let rises = heating(&edges, &heat, &points);
        let top = points.iter().zip(&rises);
        let top = top.max_by(|a, b| a.1.total_cmp(b.1));
        hottest.extend(top.map(|(x, rise)| (unit * speed * rise, [*x, strip[0].chord.y])));
        let own = rises[..middles.len()].iter();
        cells.extend(own.map(|rise| base + unit * speed * rise));
    }
    let (rise_max_k, at_mm) = peak(&hottest);
    let [x_min, x_max, ..] = of.footprint.patches()[patch].extent;
    let half_length = 0.5 * (x_max - x_min);
    let peclets = task.bodies().map(|body| body.peclet(speed, half_length));
    let summary = TemperatureSummary {
        max_c: base + rise_max_k,
        rise_max_k,
        at_mm,
        without_friction_c: base,
        heat_share_lower: task.share_of_lower(),
        peclet: peclets[0].min(peclets[1]),
    };
    (summary, cells)
}

/// Returns the maximum over the lines and its place, on a parabola through the largest value and its neighbours.
fn peak(lines: &[(f64, [f64; 2])]) -> (f64, [f64; 2]) {
    let top = (0..lines.len()).max_by(|a, b| lines[*a].0.total_cmp(&lines[*b].0));
    let Some(top) = top else {
        return (0.0, [0.0; 2]);
    };
    let (value, [x, y]) = lines[top];
    let beside = top.checked_sub(1).and_then(|k| lines.get(k));
    let (Some((before, [_, low])), Some((after, [_, high]))) = (beside, lines.get(top + 1)) else {
        return (value, [x, y]);
    };
    // Slopes on both sides. The parabola is v + s d + c d² with the distance d from the middle line.
    let (down, up) = ((value - before) / (y - low), (after - value) / (high - y));
    let curve = (up - down) / (high - low);
    if curve >= 0.0 {
        return (value, [x, y]);
    }
    let slope = down + curve * (y - low);
    let step = (-0.5 * slope / curve).clamp(low - y, high - y);
    (value + step * (slope + curve * step), [x, y + step])
}
