//! Laws that every answer must obey.

use railhead_contact::case::words::solver::MethodName;
use railhead_contact::rolling::answer::Resultants;
use railhead_contact::solution::words::answer::{
    Fields, PatchCells, PatchFields, PatchSolution, PointFields, Solution, Zone,
};
use serde_json::Value;

/// Rounding error, relative to the largest value of its kind.
const ROUNDING: f64 = 1e-9;
/// Allowed error of sums over cells in single precision.
const SUMS: f64 = 1e-6;

/// The target of a case without one.
const TARGET: f64 = 0.005;

/// Minimum number of cells to check the power. With fewer cells the balance is too inaccurate: a single cell has no moment.
const CELLS_FOR_POWER: usize = 9;

/// Scales of one patch.
struct Scales {
    /// Largest friction bound in MPa.
    bound: f64,
    /// Friction bound of the whole patch in N.
    force: f64,
    /// Largest distance of a cell from the origin in mm.
    arm: f64,
    /// Largest rigid slip.
    slip: f64,
    /// Allowed difference between resultants and sums of tractions, in N.
    apart: f64,
}

/// Returns a message for each law that an answer breaks.
pub fn broken(case: &Value, solution: &Solution, fields: &Fields) -> Vec<String> {
    let friction = case["friction"]["coefficient"].as_f64().unwrap_or(0.0);
    let mut broken = Vec::new();
    let mut load = 0.0;
    for (patch, cells) in solution.patches.iter().zip(&fields.patches) {
        load += patch.normal_force_n;
        normal(patch, cells.cells(0), &mut broken);
        tangential(case, friction, patch, cells, &mut broken);
    }
    if let Some(given) = case["load"]["normal_force_n"].as_f64()
        && (load / given - 1.0).abs() > SUMS
    {
        broken.push(format!("the patches carry {load} of {given} N"));
    }
    power(friction, solution, fields, &mut broken);
    broken
}

/// Checks that friction dissipates power in all patches together, up to their estimated errors. One patch may receive power from another.
fn power(friction: f64, solution: &Solution, fields: &Fields, broken: &mut Vec<String>) {
    let cells: usize = fields
        .patches
        .iter()
        .map(|cells| cells.cells(0).x_mm.len())
        .sum();
    let (mut power, mut uncertain) = (0.0, 0.0);
    for patch in &solution.patches {
        let point = &patch.points[0];
        power += point.friction_power_n;
        let force = point.error_estimate.map_or(0.0, |e| e.force_x_n);
        uncertain += (force + SUMS * friction * patch.normal_force_n) * slip_size(patch);
    }
    if cells >= CELLS_FOR_POWER && power < -uncertain {
        broken.push(format!("friction gains {power} N"));
    }
}

/// Returns the largest distance of the patch from the origin.
fn reach(patch: &PatchSolution) -> f64 {
    let corners = patch.extent_mm;
    corners.iter().fold(0.0_f64, |m, c| m.max(c.abs()))
}

/// Returns the size of the rigid slip.
fn slip_size(patch: &PatchSolution) -> f64 {
    let motion = &patch.points[0].motion;
    motion.creepage_x.hypot(motion.creepage_y) + motion.spin_per_mm.abs() * reach(patch)
}

fn normal(patch: &PatchSolution, cells: &PatchCells, broken: &mut Vec<String>) {
    let Some(pressure) = &cells.pressure_mpa else {
        return broken.push("there is no pressure".to_owned());
    };
    let areas = cells.dx_mm.iter().zip(&cells.dy_mm).map(|(dx, dy)| dx * dy);
    let load: f64 = pressure.iter().zip(areas).map(|(p, area)| p * area).sum();
    if pressure.iter().any(|p| !p.is_finite() || *p < 0.0) {
        broken.push("a pressure is negative or not a number".to_owned());
    }
    if (load / patch.normal_force_n - 1.0).abs() > SUMS {
        broken.push(format!(
            "the cells carry {load} of {} N",
            patch.normal_force_n
        ));
    }
}

fn tangential(
    case: &Value,
    friction: f64,
    patch: &PatchSolution,
    cells: &PatchFields,
    broken: &mut Vec<String>,
) {
    let (point, cells, fields) = (&patch.points[0], cells.cells(0), &cells.points[0]);
    let (Some(tx), Some(ty)) = (&fields.traction_x_mpa, &fields.traction_y_mpa) else {
        return broken.push("there are no tractions".to_owned());
    };
    let scales = Scales {
        bound: friction * patch.pressure_max_mpa,
        force: friction * patch.normal_force_n,
        arm: reach(patch),
        slip: slip_size(patch),
        apart: 0.0,
    };
    let found = [point.force_x_n, point.force_y_n, point.moment_z_n_mm];
    if found.iter().chain(tx).chain(ty).any(|v| !v.is_finite()) {
        return broken.push(format!("a traction or one of {found:?} is not a number"));
    }
    if point.force_x_n.hypot(point.force_y_n) > scales.force * (1.0 + ROUNDING) {
        broken.push(format!("{found:?} is more than {} N", scales.force));
    }
    if case["solver"]["traction_bound"] != "parabolic" {
        coulomb(friction, &scales, cells, fields, broken);
    }
    // Resultants with a target are extrapolated: they differ from the sums within their estimated errors.
    let targeted = point.target_met.is_some();
    let estimate = point.error_estimate.filter(|_| targeted);
    // With `auto`, the resultants may be those of the table, and the tractions those of a mesh that meets the target.
    let of_mesh = match point.solver.method {
        MethodName::Table => case["solver"]["target_error"].as_f64().unwrap_or(TARGET),
        _ => 0.0,
    };
    let scales = Scales {
        apart: (SUMS + of_mesh) * scales.force + estimate.map_or(0.0, |e| e.force_x_n),
        ..scales
    };
    sums(&scales, &found, cells, fields, broken);
    if let (Some(stick), Some(slip)) = (point.stick_area_mm2, point.slip_area_mm2) {
        // `fastsim` sums its cells, the other methods divide the area of the patch.
        if ((stick + slip) / patch.area_mm2 - 1.0).abs() > SUMS && fields.slip_x.is_some() {
            broken.push(format!("{stick} + {slip} mm² of {}", patch.area_mm2));
        }
    }
}

/// Cells of one strip are adjacent if the gap between them is less than this fraction of a cell.
const JOINED: f64 = 1e-6;

/// Checks Coulomb's law cell by cell: the bound holds, slip is along the traction, and sticking cells do not slip.
fn coulomb(
    friction: f64,
    scales: &Scales,
    cells: &PatchCells,
    fields: &PointFields,
    broken: &mut Vec<String>,
) {
    let (Some(pressure), Some(tx), Some(ty)) = (
        &cells.pressure_mpa,
        &fields.traction_x_mpa,
        &fields.traction_y_mpa,
    ) else {
        return;
    };
    let (Some(sx), Some(sy), Some(zone)) = (&fields.slip_x, &fields.slip_y, &fields.zone) else {
        return; // `fastsim` has no slips.
    };
    let mut worst = [0.0_f64; 3];
    for i in 0..tx.len() {
        let [x, y] = [tx[i], ty[i]].map(|t| t / scales.bound);
        let [u, v] = [sx[i], sy[i]].map(|s| s / scales.slip.max(f64::MIN_POSITIVE));
        worst[0] = worst[0].max(x.hypot(y) - friction * pressure[i] / scales.bound);
        worst[1] = worst[1].max(x.hypot(y) * u.hypot(v) - (x * u + y * v));
        // The last cell of a strip may stick on average and slip at its trailing end.
        let end = |i: usize, side: f64| cells.x_mm[i] + 0.5 * side * cells.dx_mm[i];
        let last = i == 0
            || cells.y_mm[i - 1] != cells.y_mm[i]
            || end(i, -1.0) - end(i - 1, 1.0) > JOINED * cells.dx_mm[i];
        if zone[i] == Zone::Stick && !last {
            worst[2] = worst[2].max(u.hypot(v));
        }
    }
    for (what, excess) in [
        "beyond the friction bound",
        "of power lost by slip across the traction",
        "of slip where a cell sticks",
    ]
    .iter()
    .zip(worst)
    {
        if excess > ROUNDING {
            broken.push(format!("{excess:.2e} {what}"));
        }
    }
}

/// Checks that the resultants are the sums of the tractions, up to the change by extrapolation.
fn sums(
    scales: &Scales,
    found: &[f64; 3],
    cells: &PatchCells,
    fields: &PointFields,
    broken: &mut Vec<String>,
) {
    let (Some(tx), Some(ty)) = (&fields.traction_x_mpa, &fields.traction_y_mpa) else {
        return;
    };
    let mut sum = Resultants::default();
    for i in 0..tx.len() {
        let area = cells.dx_mm[i] * cells.dy_mm[i];
        sum.force_x += tx[i] * area;
        sum.force_y += ty[i] * area;
    }
    for (given, sum) in found.iter().zip([sum.force_x, sum.force_y]) {
        if (given - sum).abs() > scales.apart {
            broken.push(format!("the tractions add up to {sum} N, not {given}"));
        }
    }
    if found[2].abs() > scales.force * scales.arm * 2.0_f64.sqrt() {
        broken.push(format!("{} N mm of moment", found[2]));
    }
}

/// Returns F_x/μN, F_y/μN and M_z/(μN√(A/π)) of the sum over the patches, and the estimate of their error.
pub fn relative(case: &Value, solution: &Solution) -> ([f64; 3], f64) {
    let friction = case["friction"]["coefficient"].as_f64().unwrap_or(0.0);
    let load: f64 = solution.patches.iter().map(|p| p.normal_force_n).sum();
    let area: f64 = solution.patches.iter().map(|p| p.area_mm2).sum();
    let (force, length) = (friction * load, (area / std::f64::consts::PI).sqrt());
    let total = &solution.total[0];
    let relative = [
        total.force_x_n / force,
        total.force_y_n / force,
        total.moment_z_n_mm / (force * length),
    ];
    let estimate = total.error_estimate.map_or(0.0, |e| e.force_x_n / force);
    (relative, estimate)
}

/// Returns the largest difference of F_x/μN, F_y/μN and M_z/(μN√(A/π)) of two answers to one case, about the load centre of the second and in its
/// units. Moments about a distant origin would include the difference of the areas.
pub fn difference(case: &Value, answer: &Solution, exact: &Solution) -> f64 {
    let friction = case["friction"]["coefficient"].as_f64().unwrap_or(0.0);
    let (mut load, mut area, mut centre) = (0.0, 0.0, [0.0; 2]);
    for patch in &exact.patches {
        let [x_min, x_max, y_min, y_max] = patch.extent_mm;
        load += patch.normal_force_n;
        area += patch.area_mm2;
        centre[0] += 0.5 * (x_min + x_max) * patch.normal_force_n;
        centre[1] += 0.5 * (y_min + y_max) * patch.normal_force_n;
    }
    let centre = centre.map(|moment| moment / load);
    let sum = |solution: &Solution| {
        let total = &solution.total[0];
        let sum = Resultants {
            force_x: total.force_x_n,
            force_y: total.force_y_n,
            moment_z: total.moment_z_n_mm,
        };
        sum.about(centre)
    };
    let length = (area / std::f64::consts::PI).sqrt();
    sum(answer).distance(&sum(exact), friction * load, length)
}

/// Returns the power dissipated by the cells over the power of the motion, minus 1, or `None` if too little slips.
pub fn energy(solution: &Solution, fields: &Fields) -> Option<f64> {
    let mut heat = 0.0;
    for cells in &fields.patches {
        let (point, mesh) = (&cells.points[0], cells.cells(0));
        let (tx, ty) = (
            point.traction_x_mpa.as_ref()?,
            point.traction_y_mpa.as_ref()?,
        );
        let (sx, sy) = (point.slip_x.as_ref()?, point.slip_y.as_ref()?);
        for i in 0..tx.len() {
            heat += (tx[i] * sx[i] + ty[i] * sy[i]) * mesh.dx_mm[i] * mesh.dy_mm[i];
        }
    }
    let work: f64 = solution
        .patches
        .iter()
        .map(|p| p.points[0].friction_power_n)
        .sum();
    let motion = &solution.patches[0].points[0].motion;
    let usual = solution.total[0]
        .force_x_n
        .hypot(solution.total[0].force_y_n)
        * motion.creepage_x.hypot(motion.creepage_y);
    (work > 0.05 * usual && work > 0.0).then(|| heat / work - 1.0)
}
