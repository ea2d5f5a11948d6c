//! Transient rolling on successively finer meshes until two in a row agree.

use crate::error::SolveError;
use crate::mesh::MeshSize;
use crate::monitor::{Monitor, MonitorPart};
use crate::remark::kind::short;
use crate::rolling::answer::{HistoryAnswer, LevelAnswer, MotionAnswer, SolvedFields, Work};
use crate::rolling::history::level_run::LevelRun;
use crate::rolling::history::plan;
use crate::rolling::history::plan::{HistoryStart, HistoryTask, Pace, PointRecord};
use crate::rolling::history::self_similar::{STEPS_FREE, SelfSimilarState};
use crate::rolling::refinement::error_estimate::distances;
use crate::rolling::refinement::interpolate::RefinementState;
use crate::rolling::refinement::on_mesh::named;
use crate::rolling::task::{Motion, Resolution, RollingTask, TOLERANCE_LEAST};

// The constants below come from the four histories of CONTACT in `tests/data/transient.json`, on meshes from 6 × 12 to 24 × 48 with steps of a/5 to a/32, where
// a is half the length (`cargo test --test physics -- histories_agree --nocapture` prints the results).

/// Cells along x of the first mesh. With 12 the change to the second mesh misses the default target.
const CELLS_FIRST: f64 = 16.0;
/// Ratio of the numbers of cells along x, strips and steps from mesh to mesh.
const FINER: f64 = 1.5;
/// Largest number of meshes.
const LEVELS_MAX: i32 = 4;
/// Cells along x per strip on a patch as long as wide: in rolling, and where pressing is all that is requested. In rolling, what travels through the contact is
/// smoothed over two cells, so cells count for more than strips; with 3 creepages are as accurate, moments under spin half as accurate. In pressing,
/// tractions change as much across as along.
const SHAPES: [f64; 2] = [2.0, 1.0];
/// Steps per half-length of the patch and cell along x. With twice as many the errors of creepages are up to twice as large, because shorter steps smooth less in
/// time; forces change by at most 0.002 of the limit.
const STEPS_PER_CELL: f64 = 1.0 / 3.0;
/// Share of the change from the previous mesh by which resultants are extrapolated. Their error falls slightly faster than the width of the cells. 0.25 and 0.75
/// leave 1.5 times the error.
const EXTRAPOLATED: f64 = 0.5;
/// Ratio of the error of resultants to the change from the previous mesh. Chosen so that the estimates cover the points of CONTACT's four histories
/// (`cargo test --test physics histories`), which are therefore no independent check.
const ERROR_OVER_CHANGE: f64 = 0.8;
/// The same ratio for creepages and shifts that are found.
const CREEPAGE_ERROR_OVER_CHANGE: f64 = 1.4;
/// Least change of a shift that is found, in cells along x and relative to the shift, because the changes of single shifts cross zero by chance. Chosen so that
/// the errors cover 57 shifts, alone and within histories, of which the changes alone covered 31. The closed form of Cattaneo (1938) is among them.
const SHIFT_CHANGE_LEAST: f64 = 0.18;
/// Tolerance of prescribed forces relative to the friction limit. The residual of a force causes an error of the creepage in one step.
const FORCE_TOLERANCE: f64 = 1e-5;
/// Target of the creepages and shifts that are found, relative to their largest value, over the target of the resultants.
const CREEPAGE_SHARE: f64 = 10.0;

/// One mesh of a history.
#[derive(Debug, Clone, Copy)]
struct HistoryLevel {
    size: MeshSize,
    pace: Pace,
}

/// A history solved on one mesh.
struct SolvedHistory {
    /// Number of the mesh.
    level: usize,
    points: Vec<PointRecord>,
    /// Wall time in s.
    seconds: f64,
}

/// The largest changes between two meshes at the points of a history. They count for all points: earlier errors persist, and the same event may occur slightly
/// earlier or later on another mesh.
#[derive(Debug, Clone)]
struct Changes {
    /// Changes of the resultants relative to μN, patch by patch, then of their sum.
    resultants: Vec<f64>,
    /// Changes of the creepages found.
    creepage: [f64; 2],
    /// Changes of the shifts found, in mm, at each point.
    shift: Vec<[f64; 2]>,
}

/// The reason why a history takes more steps than are allowed, if it does; `extents` are those of the patches.
pub fn too_long(history: &HistoryTask, extents: &[[f64; 4]], steps_max: usize) -> Option<String> {
    let half = half_length(extents)?;
    let pace = pace(half, CELLS_FIRST, 0);
    let steps = plan::count(history, pace);
    (steps > steps_max as f64).then(|| {
        let rolled = history.distances.last().copied().unwrap_or(0.0);
        format!(
            "{rolled} mm of rolling take {steps:.0} steps of {} mm; at most {steps_max} are allowed in one case",
            short(pace.first)
        )
    })
}

/// The number of steps on a mesh with `along` cells along x, and the number of cells of a patch. Without `along`, those of the usual finest mesh.
pub fn usual_work(history: &HistoryTask, extents: &[[f64; 4]], along: Option<f64>) -> (f64, f64) {
    let Some(half) = half_length(extents) else {
        return (history.distances.len() as f64, CELLS_FIRST * CELLS_FIRST);
    };
    let cells = along.unwrap_or(CELLS_FIRST * FINER * FINER);
    let level = if along.is_some() { 1 } else { 2 };
    let pressing = match history.start {
        HistoryStart::Pressed => STEPS_FREE as f64,
        HistoryStart::Rest | HistoryStart::Steady => 0.0,
    };
    let steps = plan::count(history, pace(half, cells, level));
    (steps + pressing, cells * cells / SHAPES[0])
}

/// Largest number of cells of a target where pressing is all that is requested.
pub fn pressed_cells_max() -> f64 {
    (CELLS_FIRST * FINER.powi(LEVELS_MAX - 1)).powi(2) / SHAPES[1]
}

/// Memory in bytes of a pressing on a mesh.
pub fn pressed_bytes(cells: f64) -> f64 {
    SelfSimilarState::bytes(cells)
}

/// The steps on a mesh with `cells` cells along x, which follows `level` coarser ones, for the half-length of the shortest patch.
fn pace(half: f64, cells: f64, level: i32) -> Pace {
    let finer = FINER.powi(level);
    Pace {
        first: half * finer / (STEPS_PER_CELL * cells),
        finer,
    }
}

/// Half the length of the shortest patch.
fn half_length(extents: &[[f64; 4]]) -> Option<f64> {
    let lengths = extents.iter().map(|e| 0.5 * (e[1] - e[0]));
    lengths.reduce(f64::min).filter(|half| *half > 0.0)
}

/// Progress before a mesh, and its share. Two meshes usually suffice, of which the second takes most of the time.
fn progress(level: usize) -> [f64; 2] {
    match level {
        0 => [0.0, 0.15],
        1 => [0.15, 0.75],
        later => {
            let left = 0.1 * 0.5_f64.powi(later as i32 - 2);
            [1.0 - left, 0.5 * left]
        }
    }
}

/// Solves a history and returns a solution per point.
///
/// # Errors
/// The reason why there is no solution.
pub fn solve(
    task: &RollingTask,
    history: &HistoryTask,
    state: &mut RefinementState,
    monitor: &dyn Monitor,
) -> Result<Vec<MotionAnswer>, SolveError> {
    let presses = history.only_presses() && !task.has_prescribed_forces();
    let plans = level_plans(task, SHAPES[usize::from(presses)]);
    let mut before: Option<SolvedHistory> = None;
    let mut seconds = 0.0;
    let mut work = Work::default();
    for (k, plan) in plans.iter().enumerate() {
        let [before_level, own] = progress(k);
        let part = MonitorPart::new(monitor, before_level, own);
        let mut found = on_level(task, history, *plan, state, &part)?;
        seconds += found.seconds;
        found.seconds = seconds;
        let last = k + 1 == plans.len();
        let Some(coarser) = before else {
            before = Some(found);
            continue;
        };
        for point in &coarser.points {
            work.add(point.work);
        }
        let mut changes = changes(task, &coarser.points, &found.points);
        if presses {
            // Forces balance in a pressing, so its error shows in the sum of the lengths of the tractions.
            let grown = (found.points[0].carried - coarser.points[0].carried).abs();
            let of_all = changes.resultants.iter_mut();
            of_all.for_each(|change| *change = change.max(grown));
        }
        let least = SHIFT_CHANGE_LEAST / f64::from(plan.size.cells);
        for (k, (change, point)) in changes.shift.iter_mut().zip(&found.points).enumerate() {
            let shift = [point.shift.creepage_x, point.shift.creepage_y];
            for i in (0..2).filter(|i| task.forces[k][*i].is_some()) {
                change[i] = change[i].max(least * shift[i].abs());
            }
        }
        if last || is_met(task, &found.points, &changes) {
            return Ok(answers(
                task,
                history,
                found,
                &coarser.points,
                &changes,
                work,
            ));
        }
        before = Some(found);
    }
    unreachable!("there are two levels at least")
}

/// The meshes of a history, coarse to fine: those of a target, with `shape` cells along x per strip on a round patch, or a client mesh after a coarser one.
fn level_plans(task: &RollingTask, shape: f64) -> Vec<HistoryLevel> {
    let patches = task.footprint.patches();
    let extents: Vec<[f64; 4]> = patches.iter().map(|patch| patch.extent).collect();
    let half = half_length(&extents).unwrap_or(1.0);
    let plan = |strips: f64, cells: f64, level: i32| HistoryLevel {
        size: MeshSize {
            strips: strips.max(2.0) as u32,
            cells: cells.max(2.0) as u32,
        },
        pace: pace(half, cells.max(8.0), level),
    };
    if let Resolution::Mesh(size) = task.resolution {
        let [strips, cells] = [size.strips, size.cells].map(f64::from);
        let even = 2.0 * (0.5 * strips / FINER).round();
        let coarse = plan(even.max(4.0), (cells / FINER).round().max(6.0), 0);
        return vec![coarse, plan(strips, cells, 1)];
    }
    // All patches have the mesh of the one with the largest load, in any order.
    let heaviest = patches
        .iter()
        .max_by(|a, b| a.normal_force.total_cmp(&b.normal_force));
    let [x0, x1, y0, y1] = heaviest.map_or([-1.0, 1.0, -1.0, 1.0], |patch| patch.extent);
    let shape = shape * ((x1 - x0) / (y1 - y0)).powf(0.45);
    let patches = (patches.len() as f64).sqrt();
    let levels = (0..LEVELS_MAX).map(|k| {
        let cells = (CELLS_FIRST * FINER.powi(k) / patches).round().max(8.0);
        let strips = 2.0 * (0.5 * cells / shape).round().max(2.0);
        plan(strips, cells, k)
    });
    levels.collect()
}

fn on_level(
    task: &RollingTask,
    history: &HistoryTask,
    plan: HistoryLevel,
    state: &mut RefinementState,
    monitor: &dyn Monitor,
) -> Result<SolvedHistory, SolveError> {
    let began = monitor.elapsed();
    let number = state.levels.level(plan.size.into())?;
    let level = state.levels.get(number);
    // A step of rolling changes little, so the tractions before it leave a small residual. With a tolerance of 1e-4 they were kept, and under small creepages
    // forces stayed up to 0.012 of the limit from steady rolling, with estimates of 0.002.
    let tolerance = [TOLERANCE_LEAST, FORCE_TOLERANCE];
    let workspace = &mut state.workspace;
    let run = LevelRun::new(task, history, &level, tolerance, workspace, monitor)?;
    let points = run
        .run(plan.pace)
        .map_err(|(point, failure)| named(failure, task, task.first_motion + point))?;
    Ok(SolvedHistory {
        level: number,
        points,
        seconds: (monitor.elapsed() - began).as_secs_f64(),
    })
}

/// The changes from one mesh to the next.
fn changes(task: &RollingTask, coarse: &[PointRecord], fine: &[PointRecord]) -> Changes {
    let patches = task.footprint.patches();
    let mut found = Changes {
        resultants: vec![0.0; patches.len() + 1],
        creepage: [0.0; 2],
        shift: Vec::with_capacity(fine.len()),
    };
    for (a, b) in coarse.iter().zip(fine) {
        let apart = distances(task, patches, &a.resultants, &b.resultants);
        for (most, apart) in found.resultants.iter_mut().zip(apart) {
            *most = most.max(apart);
        }
        let creepage = between(&a.motion, &b.motion);
        found.creepage = [0, 1].map(|k| found.creepage[k].max(creepage[k]));
        found.shift.push(between(&a.shift, &b.shift));
    }
    found
}

/// Distances of both creepages of two motions.
fn between(a: &Motion, b: &Motion) -> [f64; 2] {
    [a.creepage_x - b.creepage_x, a.creepage_y - b.creepage_y].map(f64::abs)
}

/// Whether resultants and creepages meet the target.
fn is_met(task: &RollingTask, points: &[PointRecord], changes: &Changes) -> bool {
    let Some(target) = task.target() else {
        return true;
    };
    let worst = changes.resultants.last().copied().unwrap_or(0.0);
    if ERROR_OVER_CHANGE * worst > target {
        return false;
    }
    let is_small = |of: fn(&PointRecord) -> &Motion, k: usize, change: f64| {
        let peak = points.iter().map(|point| of(point).components()[k].abs());
        CREEPAGE_ERROR_OVER_CHANGE * change <= CREEPAGE_SHARE * target * peak.fold(0.0, f64::max)
    };
    (0..2).all(|k| {
        let shift = changes.shift.iter().map(|change| change[k]);
        is_small(|point| &point.motion, k, changes.creepage[k])
            && is_small(|point| &point.shift, k, shift.fold(0.0, f64::max))
    })
}

/// Extrapolates a shift like the resultants; a given shift is equal on both meshes.
fn beyond(fine: &Motion, coarse: &Motion) -> Motion {
    let [fine, coarse] = [fine, coarse].map(Motion::components);
    Motion::of([0, 1, 2].map(|k| fine[k] + EXTRAPOLATED * (fine[k] - coarse[k])))
}

/// The solutions at the points.
fn answers(
    task: &RollingTask,
    history: &HistoryTask,
    solved: SolvedHistory,
    coarser: &[PointRecord],
    changes: &Changes,
    lost: Work,
) -> Vec<MotionAnswer> {
    let seconds = solved.seconds / solved.points.len() as f64;
    let points = solved.points.into_iter().zip(coarser).enumerate();
    points
        .map(|(k, (point, coarser))| {
            let mut work = point.work;
            if k == 0 {
                let residual = work.residual;
                work.add(lost);
                work.residual = residual;
            }
            let missed = task.tolerance(k).max(2.0 * FORCE_TOLERANCE);
            let error = |change: &f64| Some(ERROR_OVER_CHANGE * change + missed);
            let forces = task.forces[k];
            let found = |changes: [f64; 2]| {
                [0, 1].map(|k| forces[k].map(|_| CREEPAGE_ERROR_OVER_CHANGE * changes[k]))
            };
            let resultants = point.resultants.iter().zip(&coarser.resultants).enumerate();
            let extrapolated = resultants.map(|(patch, (fine, coarse))| {
                let limit = task.friction.limit(task.footprint, patch);
                fine.beyond(*coarse, EXTRAPOLATED, limit)
            });
            MotionAnswer {
                motion: point.motion,
                saturated: point.saturated,
                errors: changes.resultants.iter().map(error).collect(),
                history: Some(HistoryAnswer {
                    distance: history.distances[k],
                    shift: (history.rolled(k) == 0.0).then(|| beyond(&point.shift, &coarser.shift)),
                    power: point.power,
                    dissipated: point.dissipated,
                    creepage_errors: found(changes.creepage),
                    shift_errors: found(changes.shift[k]),
                }),
                fields: Some(SolvedFields {
                    level: solved.level,
                    tangential: LevelAnswer {
                        traction: point.traction,
                        slip: point.slip,
                        slips: point.slips,
                        work,
                        ..LevelAnswer::default()
                    },
                }),
                resultants: extrapolated.collect(),
                work,
                method: task.method,
                seconds,
                ..MotionAnswer::default()
            }
        })
        .collect()
}
