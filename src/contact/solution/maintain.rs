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
use crate::rolling::strip_mesh::StripMesh;
use crate::solution::words::answer::{PointFields, PointSolution};
use crate::solution::words::evolution::{SubsurfaceSummary, TemperatureSummary};

/// Smallest Péclet number at which heat flows only into the depth (Jaeger 1942). Below it, the computed temperatures are too high.
const PECLET_LEAST: f64 = 10.0;

/// Values per cell and remarks that follow from a solved motion.
#[derive(Default)]
pub(crate) struct KeptValues {
    /// The values of each patch.
    pub(crate) fields: Vec<PointFields>,
    pub(crate) remarks: Vec<Remark>,
}

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

/// Computes results from the cells of a motion. Writes summaries to its points and returns the values per cell. In a history, slips are those
/// of the step to the point.
pub(crate) fn add_rest(
    case: &CheckedCase,
    solved: SolvedMotion,
    is_of_history: bool,
    points: &mut [PointSolution],
    monitor: &dyn Monitor,
) -> Result<KeptValues, Stop> {
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
            let found = temperatures(task, solved, &power);
            for ((point, kept), found) in points.iter_mut().zip(&mut kept).zip(found) {
                point.temperature = Some(found.summary);
                kept.temperature_c = Some(found.cells);
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
    let stresses = add_stresses(case, solved, points, &mut kept, monitor)?;
    Ok(KeptValues {
        fields: kept,
        remarks: slow.into_iter().chain(stresses).collect(),
    })
}

/// Computes stresses below the surface, if they are requested, and returns a remark on them.
fn add_stresses(
    case: &CheckedCase,
    solved: SolvedMotion,
    points: &mut [PointSolution],
    kept: &mut [PointFields],
    monitor: &dyn Monitor,
) -> Result<Option<Remark>, Stop> {
    let Some(task) = &case.run.after.subsurface else {
        return Ok(None);
    };
    let found = subsurface(task, solved, monitor)?;
    let gap = found.iter().map(|found| found.gap).fold(0.0, f64::max);
    for ((point, kept), found) in points.iter_mut().zip(kept).zip(found) {
        point.subsurface = Some(found.summary);
        kept.subsurface = Some(found.points);
    }
    Ok(ball_remark(gap))
}

/// Returns the remark on a passage whose smallest enclosing ball of stresses was not found to its tolerance.
fn ball_remark(gap: f64) -> Option<Remark> {
    (gap > GAP).then_some(Remark::IterationInexact {
        iteration: "the smallest ball about the stresses of a passage",
        reason: "the iteration limit was reached",
        residual: gap,
        tolerance: GAP,
    })
}

/// Stresses below one patch.
struct PatchStresses {
    summary: SubsurfaceSummary,
    /// The stresses at the requested points, as [`stored`].
    points: Vec<f64>,
    /// Relative gap of the search for smallest enclosing balls; 0 without a passage.
    gap: f64,
}

/// Returns the smallest depth of stresses below a patch in mm. Closer to the surface, the steps of the traction between cells distort them. At
/// this depth the largest error in the reference contacts is 0.3 % of the largest pressure
/// (`cargo test --test physics -- stresses_are --nocapture`).
fn least_depth(patch: &Patch) -> f64 {
    let [x_min, x_max, y_min, y_max] = patch.extent;
    DEPTHS[0] * 0.5 * (x_max - x_min).min(y_max - y_min)
}

/// Returns the load on the surface of the requested body.
fn loaded<'a>(task: &SubsurfaceTask, of: SolvedMotion<'a>) -> SurfaceLoad<'a> {
    // The lower body's normal is up, the upper's down, and tractions on it are the reactions.
    let sign = match task.body {
        BodyName::Lower => 1.0,
        BodyName::Upper => -1.0,
    };
    SurfaceLoad::new(of, sign, task.poisson_ratio)
}

/// Computes the stresses below each patch. All patches of a frame load the same body, so each point has the stresses of all of them.
fn subsurface(
    task: &SubsurfaceTask,
    of: SolvedMotion,
    monitor: &dyn Monitor,
) -> Result<Vec<PatchStresses>, Stop> {
    let load = loaded(task, of);
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
    let mut found = Vec::with_capacity(patches.len());
    let mut shared: Option<([f64; 2], Vec<f64>)> = None;
    for (k, patch) in patches.iter().enumerate() {
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
        let points = match (&task.places, worst) {
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
        found.push(PatchStresses {
            summary: SubsurfaceSummary {
                body: task.body,
                least_depth_mm: least,
                worst,
                passage: passage.map(|passage| passage.summary),
            },
            points,
            gap: passage.map_or(0.0, |passage| passage.gap),
        });
    }
    Ok(found)
}

/// Temperatures in one patch.
struct PatchTemperatures {
    summary: TemperatureSummary,
    /// Temperature of both surfaces at the middle of each cell, in °C.
    cells: Vec<f64>,
}

/// Computes the temperatures of each patch. All segments of a strip in the patch heat it.
fn temperatures(task: &Thermal, of: SolvedMotion, power: &CellPower) -> Vec<PatchTemperatures> {
    let speed = of.speed.unwrap_or(0.0);
    let unit = match speed > 0.0 {
        true => task.rise_of(speed),
        false => 0.0,
    };
    let base = task.without_heat();
    let patches = of.footprint.patches().iter().enumerate();
    let of_patch = |(k, patch): (usize, &Patch)| {
        let mut cells = Vec::with_capacity(of.level.patch_cells(k).len());
        let mut hottest: Vec<(f64, [f64; 2])> = Vec::new();
        for line in heated_lines(of.level, power, k) {
            let rises = heating(&line.edges, &line.heat, &line.points);
            let places = line.points.iter().zip(&rises);
            let top = places.max_by(|a, b| a.1.total_cmp(b.1));
            hottest.extend(top.map(|(x, rise)| (unit * speed * rise, [*x, line.y])));
            let own = rises[..line.cells].iter();
            cells.extend(own.map(|rise| base + unit * speed * rise));
        }
        let (rise_max_k, at_mm) = peak(&hottest);
        let half_length = 0.5 * (patch.extent[1] - patch.extent[0]);
        let peclets = task.bodies().map(|body| body.peclet(speed, half_length));
        let summary = TemperatureSummary {
            max_c: base + rise_max_k,
            rise_max_k,
            at_mm,
            without_friction_c: base,
            heat_share_lower: task.share_of_lower(),
            peclet: peclets[0].min(peclets[1]),
        };
        PatchTemperatures { summary, cells }
    };
    patches.map(of_patch).collect()
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

/// A strip with its heat sources: cells with heat, and gaps between segments without.
struct HeatedLine {
    y: f64,
    edges: Vec<f64>,
    /// Heat per area over the rolling speed between the edges, in N/mm².
    heat: Vec<f64>,
    /// x where temperatures are computed: first the middles of the cells, then the edges.
    points: Vec<f64>,
    cells: usize,
}

/// Returns the strips of a patch with their heat sources.
fn heated_lines(level: &StripMesh, power: &CellPower, patch: usize) -> Vec<HeatedLine> {
    let mesh = &level.mesh;
    let mut lines: Vec<(usize, HeatedLine)> = Vec::new();
    for segment in mesh.segments.iter().filter(|s| s.chord.patch == patch) {
        let chord = &segment.chord;
        if lines.last().is_none_or(|(strip, _)| *strip != chord.strip) {
            let line = HeatedLine {
                y: chord.y,
                edges: vec![mesh.left[segment.cells.start]],
                heat: Vec::new(),
                points: Vec::new(),
                cells: 0,
            };
            lines.push((chord.strip, line));
        }
        let Some((_, line)) = lines.last_mut() else {
            continue;
        };
        let last = line.edges[line.edges.len() - 1];
        if mesh.left[segment.cells.start] > last {
            line.edges.push(mesh.left[segment.cells.start]);
            line.heat.push(0.0);
        }
        for i in segment.cells.clone() {
            line.edges.push(mesh.right[i]);
            line.heat.push(power.power[i] / level.area[i]);
            line.points.push(0.5 * (mesh.left[i] + mesh.right[i]));
            line.cells += 1;
        }
    }
    let mut lines: Vec<HeatedLine> = lines.into_iter().map(|(_, line)| line).collect();
    for line in &mut lines {
        line.points.extend_from_slice(&line.edges);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_that_was_not_found_exactly_is_told() {
        assert_eq!(ball_remark(0.5 * GAP), None);
        let remark = ball_remark(1e-3).expect("a remark");
        assert_eq!(remark.code(), "iteration-inexact");
        assert!(remark.detail().contains("1.00e-3"), "{}", remark.detail());
    }
}
