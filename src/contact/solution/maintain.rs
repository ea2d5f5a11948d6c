//! What follows from a solved motion for maintenance: stresses below the surface, temperatures, wear across the patch.

use crate::case::words::solver::Output;
use crate::case::words::subsurface::BodyName;
use crate::method::Method;
use crate::monitor::{Monitor, Stop};
use crate::normal::footprint::Footprint;
use crate::normal::hertz::Patch;
use crate::post::damage::{CellWear, DamageTask, DamagedPatch, across, damage};
use crate::post::local_power::{CellPower, PowerTask, ThermalTask, cell_power, heating};
use crate::post::subsurface::load_parts::LoadResolution;
use crate::post::subsurface::states::{
    STORED, StressPlaces, SubsurfaceTask, in_patch_axes, point, stored,
};
use crate::post::subsurface::surface_load::{LoadWorkspace, SurfaceLoad};
use crate::post::subsurface::worst::{GAP, worst_place};
use crate::post::subsurface::worst_passage::{PassagesOf, passage};
use crate::problem::checked_case::CheckedCase;
use crate::remark::list::Remark;
use crate::rolling::answer::LevelAnswer;
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::Motion;
use crate::solution::words::answer::{PointFields, PointSolution};
use crate::solution::words::damage::WearAcross;
use crate::solution::words::evolution::{SubsurfaceSummary, TemperatureSummary};

/// Stresses are answered from this part of the half-width of the smaller patch on: nearer to the surface the steps of the traction from cell
/// to cell would show, whose stresses grow without bound. There the largest error in the reference contacts is 0.3 % of the largest pressure
/// (`cargo test --test physics -- stresses_are --nocapture`).
const LEAST_DEPTH: f64 = 0.01;
/// Péclet number from which heat may be taken to flow only into the depth (Jaeger 1942): below it the temperatures are too high.
const PECLET_LEAST: f64 = 10.0;
/// Points between two looks at the monitor.
const POINTS_UNASKED: usize = 1024;

/// What follows from the cells of a motion beside the summaries of its points.
#[derive(Default)]
pub(crate) struct KeptValues {
    /// The values that are kept of every patch.
    pub(crate) fields: Vec<PointFields>,
    /// What there is to say of them.
    pub(crate) remarks: Vec<Remark>,
}

/// A motion solved on a level.
#[derive(Clone, Copy)]
pub(crate) struct SolvedMotion<'a> {
    pub(crate) footprint: &'a Footprint,
    pub(crate) level: &'a StripMesh,
    pub(crate) answer: &'a LevelAnswer,
    pub(crate) motion: &'a Motion,
    pub(crate) method: Method,
    /// Rolling speed in mm/s, where it is known.
    pub(crate) speed: Option<f64>,
}

/// Damage of every patch, from its resultants and its friction limit in N.
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

/// Derives the results of a motion from its cells: summaries are written to its points, the rest is returned. The slips of a point of a history are those of
/// its step.
pub(crate) fn add_rest(
    case: &CheckedCase,
    solved: SolvedMotion,
    is_of_history: bool,
    points: &mut [PointSolution],
    monitor: &dyn Monitor,
) -> Result<KeptValues, Stop> {
    let run = &case.run;
    let mut kept = vec![PointFields::default(); points.len()];
    let keep_slips = |slips: &[Vec<f64>; 2], kept: &mut [PointFields]| {
        let kept = kept.iter_mut().enumerate();
        for (k, kept) in kept.filter(|_| run.wants(Output::Slip)) {
            let cells = solved.level.patch_cells(k);
            let [x, y] = [0, 1].map(|c| slips[c][cells.clone()].to_vec());
            (kept.slip_x, kept.slip_y) = (Some(x), Some(y));
        }
    };
    if is_of_history {
        let unit = solved.level.scale.slip();
        let slips = solved.answer.slip.each_ref();
        let slips = slips.map(|slips| slips.iter().map(|slip| unit * slip).collect());
        keep_slips(&slips, &mut kept);
    } else if run.after.needs_power(&run.outputs) {
        let totals: Vec<f64> = points.iter().map(|p| p.friction_power_n).collect();
        let task = PowerTask {
            level: solved.level,
            answer: solved.answer,
            motion: solved.motion,
            method: solved.method,
            totals: &totals,
        };
        let power = cell_power(&task, monitor)?;
        keep_slips(&power.slip, &mut kept);
        if let Some(task) = run.after.damage.as_ref().filter(|task| task.across) {
            let found = wear_across(task, solved, &power);
            for (point, found) in points.iter_mut().zip(found) {
                if let Some(damage) = &mut point.damage {
                    damage.across = Some(found);
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
    }
    let slow = points
        .iter()
        .filter_map(|point| point.temperature.map(|found| found.peclet));
    let slow = slow_remark(slow.fold(f64::INFINITY, f64::min));
    let stresses = add_stresses(case, solved, points, &mut kept, monitor)?;
    Ok(KeptValues {
        fields: kept,
        remarks: slow.into_iter().chain(stresses).collect(),
    })
}

/// Stresses below the surface, where they are asked for; what there is to say of them is returned.
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

/// The remark on a contact that passes too slowly for heat to flow only into the depth, at this smallest Péclet number of its patches; infinite where
/// no temperatures are asked for.
fn slow_remark(peclet: f64) -> Option<Remark> {
    (peclet < PECLET_LEAST).then_some(Remark::HeatSpreads {
        peclet,
        least: PECLET_LEAST,
    })
}

/// The remark on a passage whose smallest ball about the stresses was not found to its tolerance.
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
    /// The requested points as they are stored.
    points: Vec<f64>,
    /// What is left of the search for smallest balls; 0 where no passage is judged.
    gap: f64,
}

fn least_depth(patch: &Patch) -> f64 {
    let [x_min, x_max, y_min, y_max] = patch.extent;
    LEAST_DEPTH * 0.5 * (x_max - x_min).min(y_max - y_min)
}

/// The loads on the body that is asked for.
fn loaded<'a>(task: &SubsurfaceTask, of: SolvedMotion<'a>) -> SurfaceLoad<'a> {
    // The lower body's normal is up, the upper's down, and tractions on it are the reactions.
    let sign = match task.body {
        BodyName::Lower => 1.0,
        BodyName::Upper => -1.0,
    };
    SurfaceLoad::new(of.level, of.footprint, of.answer, sign, task.poisson_ratio)
}

/// Stresses below every patch. Patches of one frame load the same body: each point feels all of them.
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
        for places in places.chunks(POINTS_UNASKED) {
            monitor.go_on(0.0)?;
            let deep = |[x, y, depth]: &[f64; 3]| [*x, *y, depth.max(least)];
            let places: Vec<[f64; 3]> = places.iter().map(deep).collect();
            let stresses = load.stresses(&places, LoadResolution::FINE, workspace);
            for (at, stress) in places.into_iter().zip(stresses) {
                values.extend(stored(at, in_patch_axes(stress, task.body)));
            }
        }
        Ok(values)
    };
    let below_worst = matches!(task.places, StressPlaces::BelowWorst(_));
    let mut found = Vec::with_capacity(patches.len());
    let mut shared: Option<([f64; 2], Vec<f64>)> = None;
    for (k, patch) in patches.iter().enumerate() {
        monitor.go_on(0.0)?;
        let place = PassagesOf {
            load: &load,
            footprint: of.footprint,
            patch: k,
            least: least_depth(patch),
        };
        let worst = (task.worst || below_worst || task.passage.is_some())
            .then(|| worst_place(&load, of.footprint, k, place.least, workspace))
            .flatten();
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
        let asked = task.passage.zip(worst);
        let judged = asked.map(|(asked, worst)| passage(asked, place, worst, monitor));
        let judged = judged.transpose()?;
        let summary = SubsurfaceSummary {
            body: task.body,
            least_depth_mm: least,
            worst: worst.filter(|_| task.worst || below_worst).map(|at| {
                point(
                    at,
                    in_patch_axes(load.stress(at, LoadResolution::FINE, workspace), task.body),
                )
            }),
            passage: judged.map(|judged| judged.summary),
        };
        found.push(PatchStresses {
            summary,
            points,
            gap: judged.map_or(0.0, |judged| judged.gap),
        });
    }
    Ok(found)
}

/// Temperatures in one patch.
struct PatchTemperatures {
    summary: TemperatureSummary,
    /// Of both surfaces at the middle of every cell, in °C.
    cells: Vec<f64>,
}

/// Temperatures of every patch; each strip is heated by all its segments in the patch.
fn temperatures(task: &ThermalTask, of: SolvedMotion, power: &CellPower) -> Vec<PatchTemperatures> {
    let speed = of.speed.unwrap_or(0.0);
    let unit = if speed > 0.0 {
        task.rise_of(speed)
    } else {
        0.0
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
        let peclets = [task.lower, task.upper].map(|body| body.peclet(speed, half_length));
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

/// The largest of what the lines have, each at its place: on a parabola through the largest and its neighbours.
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
    // Slopes of the two sides; the parabola is v + s d + c d² with d from the middle line.
    let (down, up) = ((value - before) / (y - low), (after - value) / (high - y));
    let curve = (up - down) / (high - low);
    if curve >= 0.0 {
        return (value, [x, y]);
    }
    let slope = down + curve * (y - low);
    let step = (-0.5 * slope / curve).clamp(low - y, high - y);
    (value + step * (slope + curve * step), [x, y + step])
}

/// A strip as heat sees it: cells with their heat over the rolling speed, gaps between segments without.
struct HeatedLine {
    y: f64,
    edges: Vec<f64>,
    /// N/mm².
    heat: Vec<f64>,
    /// Where temperatures are looked at: first the middles of the cells, then their edges.
    points: Vec<f64>,
    cells: usize,
}

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

/// Wear strip by strip of every patch.
fn wear_across(task: &DamageTask, of: SolvedMotion, power: &CellPower) -> Vec<WearAcross> {
    let slip: Vec<f64> = (0..power.power.len())
        .map(|i| power.slip[0][i].hypot(power.slip[1][i]))
        .collect();
    let cells = CellWear {
        level: of.level,
        power: &power.power,
        slip: &slip,
        speed: of.speed,
    };
    (0..of.footprint.patches().len())
        .map(|patch| across(task, cells, patch))
        .collect()
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
