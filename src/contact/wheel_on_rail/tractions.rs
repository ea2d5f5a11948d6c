//! Tractions of the patches of a wheel on a rail, and their forces.

use std::sync::Arc;

use crate::error::SolveError;
use crate::friction::law::{FrictionLaw, on_rail};
use crate::geometry::reference_curve::{CurvePlace, RigidMotion, WheelOver};
use crate::monitor::{Monitor, Stop};
use crate::normal::footprint::{Footprint, SurfaceSlip};
use crate::normal::hertz::Patch;
use crate::normal::on_curve::{CurveContact, Workspace};
use crate::normal::pressure_field::field::PressureField;
use crate::normal::pressure_field::grid_pressure::GridPressure;
use crate::normal_stage::SolvedFootprint;
use crate::numerics::roots::bounds;
use crate::problem::checked_case::CheckedCase;
use crate::problem::physics::Run;
use crate::rolling::answer::{MotionAnswer, Resultants};
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::Motion;
use crate::rolling_stage;
use crate::solution::assemble::Assembly;
use crate::solution::words::answer::{Fields, NormalReport, Solution};
use crate::time_limit::TimeLimit;
use crate::vertical_equilibrium::tolerance;
use crate::wheel_on_rail::{WheelSolve, minus};

/// Most patches. Rough profiles have more, each with few points. Solving their tractions together would take minutes without a meaningful result.
const PATCHES_MAX: usize = 4;

/// Patches whose tractions are solved together.
pub(super) struct Part {
    /// x and s in mm of the origin of its coordinates.
    pub(super) origin: [f64; 2],
    /// Load centres `[x, s]` of the patches in mm.
    pub(super) centres: Vec<[f64; 2]>,
    case: CheckedCase,
    /// The patches and their pressures about the origin.
    footprint: SolvedFootprint,
    /// The answer to each motion, with the mesh of its fields.
    motions: Vec<(MotionAnswer, Option<Arc<StripMesh>>)>,
}

impl Part {
    /// The patches about the origin.
    pub(super) fn patches(&self) -> &[Patch] {
        self.footprint.footprint.patches()
    }

    /// Friction limits of the patches in N.
    pub(super) fn limits(&self) -> impl Iterator<Item = f64> {
        let footprint = &self.footprint.footprint;
        let friction = &self.case.problem.friction;
        (0..self.centres.len()).map(|k| friction.limit(footprint, k))
    }

    /// Extrapolated forces of the patches in a motion.
    pub(super) fn resultants(&self, index: usize) -> &[Resultants] {
        &self.motions[index].0.resultants
    }

    /// The solution about the origin, with the requested outputs.
    pub(super) fn assembled(&self, monitor: &dyn Monitor) -> Result<(Solution, Fields), Stop> {
        let mut assembly = Assembly::new(&self.case, &self.footprint);
        for (motion, level) in &self.motions {
            assembly.add(level.as_ref(), motion, monitor)?;
        }
        Ok(assembly.finish())
    }
}

/// Forces of a patch in N, summed over its cells.
#[derive(Clone, Copy, Default)]
pub(super) struct PatchForces {
    /// Sums of the pressures times the sine and the cosine of the angle of their strips.
    pub(super) pressed: [f64; 2],
    /// Sums of the tractions along x, and of those along s times the cosine and the sine of the angle.
    pub(super) sheared: [f64; 3],
}

impl PatchForces {
    /// The angle at which the resultant of the pressures is normal.
    pub(super) fn angle(&self) -> f64 {
        self.pressed[0].atan2(self.pressed[1])
    }

    /// The force on the rail in track axes.
    pub(super) fn in_track(&self) -> [f64; 3] {
        let ([across, down], [x, y, z]) = (self.pressed, self.sheared);
        [x, y + across, z - down]
    }
}

impl WheelSolve<'_> {
    /// Solves the tractions of all parts of a contact. For bodies that differ, `open` is the error of the forces due to the pressures, relative to the
    /// friction limit.
    pub(super) fn tractions(
        &self,
        contact: &CurveContact,
        run: &Run,
        open: f64,
        workspace: &mut Workspace,
    ) -> Result<Vec<Part>, SolveError> {
        let slip = match self.curve.is_flat() {
            true => None,
            false => contact
                .operator
                .slip_of_pressure(&contact.pressure, workspace),
        };
        let parts = contact.parts(self.influence);
        let motions = parts.len() * self.case.problem.motions.len();
        let watch = TimeLimit::new(self.watch, run.time_limit, motions);
        let parts = parts
            .into_iter()
            .map(|strips| contact.patches(strips, true));
        let parts: Vec<Vec<GridPressure>> = parts.collect::<Result<_, _>>()?;
        let patches: usize = parts.iter().map(Vec::len).sum();
        if patches > PATCHES_MAX && !self.curve.is_flat() {
            return Err(SolveError::normal_problem(format!(
                "the contact on the curve of the rail splits into {patches} patches; at most {PATCHES_MAX} can be solved together; smooth the \
                     profiles, or give reference_surface \"plane\""
            )));
        }
        let mut solved = Vec::with_capacity(parts.len());
        for patches in parts {
            solved.push(self.part(contact, patches, slip.as_ref(), (run, open), &watch)?);
        }
        Ok(solved)
    }

    /// Solves the tractions of some patches together. `slip` is the slip that the pressures cause.
    fn part(
        &self,
        contact: &CurveContact,
        patches: Vec<GridPressure>,
        slip: Option<&[Vec<f64>; 2]>,
        (run, open): (&Run, f64),
        watch: &TimeLimit,
    ) -> Result<Part, SolveError> {
        let CheckedCase { problem, label, .. } = self.case;
        let field = CurveContact::field(patches)?;
        let loads = field.patches();
        let centres: Vec<[f64; 2]> = (0..loads.len())
            .map(|k| field.load_centre(Some(k)))
            .collect();
        let heaviest = (0..loads.len())
            .max_by(|a, b| loads[*a].normal_force.total_cmp(&loads[*b].normal_force))
            .unwrap_or(0);
        let origin = match self.curve.is_flat() {
            true => field.load_centre(None),
            false => centres[heaviest],
        };
        let under = |motion: &Motion, of_pressure| {
            let (place, over) = self.load_centre(contact, origin)?;
            let rigid = self.rigid(contact, &field, motion)?;
            let motion = creepages(&rigid[heaviest], origin[0], &place, &over);
            let slip = self.surface_slip(contact, &field, &rigid, of_pressure, origin, &motion);
            Ok::<_, SolveError>((motion, Some(slip)))
        };
        let (motions, slip, by_motion) = match problem.history {
            _ if self.curve.is_flat() => (self.plane_motions(contact, &field, origin)?, None, None),
            None => {
                let (motion, slip) = under(&problem.motions[0], slip)?;
                (vec![motion], slip, None)
            }
            Some(_) => {
                let (_, still) = under(&Motion::default(), slip)?;
                let unit = |creepage_y, spin_per_mm| Motion {
                    creepage_x: 0.0,
                    creepage_y,
                    spin_per_mm,
                };
                let (_, across) = under(&unit(1.0, 0.0), None)?;
                let (_, spin) = under(&unit(0.0, 1.0), None)?;
                (
                    problem.motions.clone(),
                    still,
                    across.zip(spin).map(<[_; 2]>::from),
                )
            }
        };
        let report = NormalReport {
            force_residual: contact.missed,
            ..contact.work.with_time(0.0)
        };
        let extents = loads.iter().map(|patch| patch.extent);
        let friction = self.friction_at(origin, extents);
        let unbalanced = match self.is_vertical() {
            true => tolerance(run.resolution),
            false => 0.0,
        };
        let load_error = contact.missed.hypot(unbalanced);
        let footprint = SolvedFootprint {
            footprint: Footprint::computed(
                field.from_origin(origin),
                load_error,
                contact.work.residual,
            )
            .on_surface(
                slip,
                by_motion,
                centres.iter().map(|centre| minus(*centre, origin)),
            ),
            report: Some(report),
            coupling_error: open,
            remarks: Vec::new(),
        };
        let case = CheckedCase {
            problem: problem.of_gap(friction, motions),
            run: run.clone(),
            label: label.clone(),
            remarks: Vec::new(),
        };
        case.fits(&footprint.footprint)?;
        let mut motions = Vec::new();
        let add = &mut |motion, level| {
            motions.push((motion, level));
            Ok(())
        };
        rolling_stage::solve_motions(self.operators, &case, &footprint, watch, add)?;
        Ok(Part {
            origin,
            centres,
            case,
            footprint,
            motions,
        })
    }

    /// Friction of patches with these extents `[x_min, x_max, s_min, s_max]` about an origin `[x, s]`, in mm.
    pub(super) fn friction_at(
        &self,
        origin: [f64; 2],
        extents: impl Iterator<Item = [f64; 4]>,
    ) -> FrictionLaw {
        let friction = &self.case.problem.friction;
        let rail = |s| self.curve.at(s).rail;
        on_rail(friction, &self.contact.geometry, extents, origin, rail)
    }

    /// The motions of a plane about an origin `[x, s]` on it: those of the case. For a wheelset it is the mean of the motions at the load centres of
    /// the patches, weighted with their forces.
    fn plane_motions(
        &self,
        contact: &CurveContact,
        field: &PressureField,
        origin: [f64; 2],
    ) -> Result<Vec<Motion>, SolveError> {
        let problem = &self.case.problem;
        let Some(wheelset) = &problem.wheelset else {
            return Ok(problem.motions.clone());
        };
        let rigid = RigidMotion::of_wheelset(&self.contact.geometry, contact.centre, wheelset);
        let patches = field.patches();
        let force: f64 = patches.iter().map(|patch| patch.normal_force).sum();
        let mut mean = Motion::default();
        for (k, patch) in patches.iter().enumerate() {
            let centre = field.load_centre(Some(k));
            let (place, over) = self.load_centre(contact, centre)?;
            let own = creepages(&rigid, centre[0], &place, &over);
            let [dx, ds] = minus(centre, origin);
            let share = patch.normal_force / force;
            mean.creepage_x += share * (own.creepage_x + own.spin_per_mm * ds);
            mean.creepage_y += share * (own.creepage_y - own.spin_per_mm * dx);
            mean.spin_per_mm += share * own.spin_per_mm;
        }
        Ok(vec![mean])
    }

    /// The motion of the wheel as a rigid body at each patch. If the case gives the motion of a wheelset, it is the same at all patches. Otherwise it
    /// has the given creepages at the load centre of the patch.
    fn rigid(
        &self,
        contact: &CurveContact,
        field: &PressureField,
        creepages: &Motion,
    ) -> Result<Vec<RigidMotion>, SolveError> {
        let (problem, geometry) = (&self.case.problem, &self.contact.geometry);
        let patches = 0..field.patches().len();
        if let Some(wheelset) = &problem.wheelset {
            let motion = RigidMotion::of_wheelset(geometry, contact.centre, wheelset);
            return Ok(patches.map(|_| motion).collect());
        }
        let Motion {
            creepage_x,
            creepage_y,
            spin_per_mm,
        } = *creepages;
        let of = |patch: usize| {
            let centre = field.load_centre(Some(patch));
            let (place, over) = self.load_centre(contact, centre)?;
            let point = place.point(centre[0], over.gap);
            let creepages = [creepage_x, creepage_y, spin_per_mm];
            Ok(RigidMotion::of_creepages(point, &place, creepages))
        };
        patches.map(of).collect()
    }

    /// The difference between the slip of the surface and that of a motion about an origin `[x, s]`.
    ///
    /// The deformed surface of equal bodies lies halfway between the undeformed surfaces, that of other bodies nearer to the stiffer one. The rolling
    /// radius of a strip is taken there, corrected so that the deepest strip keeps the radius of the undeformed wheel, to which creepages refer.
    /// The curvature of the wheel along x is neglected, because half-spaces lack other terms of the same size. A flat surface therefore has the slip
    /// of a plane.
    fn surface_slip(
        &self,
        contact: &CurveContact,
        field: &PressureField,
        rigid: &[RigidMotion],
        of_pressure: Option<&[Vec<f64>; 2]>,
        origin: [f64; 2],
        motion: &Motion,
    ) -> SurfaceSlip {
        let grid = &contact.grid;
        let extents: Vec<[f64; 4]> = field.patches().iter().map(|patch| patch.extent).collect();
        let patch_of = |s: f64| {
            let far = |k: &usize| {
                let [.., low, high] = extents[*k];
                (low - s).max(s - high).max(0.0)
            };
            (0..extents.len()).min_by(|a, b| far(a).total_cmp(&far(b)))
        };
        let least = |gaps: &[f64]| bounds(gaps.iter().copied())[0];
        let deepest = least(&contact.gap);
        let share = self.case.problem.elasticity.lower_share;
        let mut slip = [Vec::new(), Vec::new()];
        for (j, place) in grid.places.iter().enumerate() {
            let rigid = &rigid[patch_of(place.s).unwrap_or(0)];
            let row = &contact.gap[j * grid.x.len()..(j + 1) * grid.x.len()];
            let gap = (1.0 - share) * deepest + share * least(row).min(0.0);
            // The slip is linear in x.
            let [at, by_x] = [0.0, 1.0].map(|x| rigid.slip(place.point(x, gap), place));
            for (i, x) in grid.x.iter().enumerate() {
                let k = j * grid.x.len() + i;
                let own = [0, 1].map(|axis| at[axis] + x * (by_x[axis] - at[axis]));
                let [dx, ds] = [x - origin[0], place.s - origin[1]];
                let plane = [
                    motion.creepage_x - motion.spin_per_mm * ds,
                    motion.creepage_y + motion.spin_per_mm * dx,
                ];
                for (axis, slip) in slip.iter_mut().enumerate() {
                    let pressed = of_pressure.map_or(0.0, |of_pressure| of_pressure[axis][k]);
                    slip.push(own[axis] - plane[axis] + pressed);
                }
            }
        }
        SurfaceSlip {
            x: (grid.x[0] - origin[0], grid.step[0], grid.x.len()),
            y: grid
                .places
                .iter()
                .map(|place| place.s - origin[1])
                .collect(),
            slip,
        }
    }

    /// Forces in a motion of every patch of every part: of the pressures on the grid, and of the tractions, scaled to their extrapolated resultants.
    pub(super) fn forces(
        &self,
        contact: &CurveContact,
        parts: &[Part],
        index: usize,
    ) -> Vec<Vec<PatchForces>> {
        let of_part = |part: &Part| {
            let of_patch = |k: usize| {
                let mut forces = PatchForces {
                    pressed: self.pressed(contact, part, k),
                    ..PatchForces::default()
                };
                let (mut shear, mut plain) = ([0.0; 3], [0.0; 2]);
                each_cell(part, k, index, |place, _, area, [x, y, _]| {
                    let (sin, cos) = self.curve.at(place[1]).angle.sin_cos();
                    plain = [plain[0] + area * x, plain[1] + area * y];
                    shear[1] += area * y * cos;
                    shear[2] += area * y * sin;
                });
                let (sin, cos) = forces.angle().sin_cos();
                let found = part.resultants(index)[k];
                let beyond = found.force_y - plain[1];
                forces.sheared = [
                    found.force_x,
                    shear[1] + beyond * cos,
                    shear[2] + beyond * sin,
                ];
                forces
            };
            (0..part.centres.len()).map(of_patch).collect()
        };
        parts.iter().map(of_part).collect()
    }

    /// Sums of the pressures of a patch times the sine and the cosine of their angles, in N.
    fn pressed(&self, contact: &CurveContact, part: &Part, patch: usize) -> [f64; 2] {
        let grid = &contact.grid;
        let [x_min, x_max, s_min, s_max] = part.patches()[patch].extent;
        let alone = part.centres.len() == 1 && contact.parts(self.influence).len() == 1;
        let mut sums = [0.0; 2];
        for (j, place) in grid.places.iter().enumerate() {
            let s = place.s - part.origin[1];
            let row = &contact.pressure[j * grid.x.len()..(j + 1) * grid.x.len()];
            if !alone && !(s_min - grid.step[1]..=s_max + grid.step[1]).contains(&s) {
                continue;
            }
            let inside = |x: f64| {
                let x = x - part.origin[0];
                alone || (x_min - grid.step[0]..=x_max + grid.step[0]).contains(&x)
            };
            let cells = grid.x.iter().zip(row).filter(|(x, _)| inside(**x));
            let load: f64 = cells.map(|(_, p)| p).sum();
            let (sin, cos) = place.angle.sin_cos();
            sums = [sums[0] + load * sin, sums[1] + load * cos];
        }
        sums.map(|sum| sum * grid.area())
    }

    /// Tractions of a motion on the cells of the grid in MPa, with the same forces.
    pub(super) fn on_grid(
        &self,
        contact: &CurveContact,
        parts: &[Part],
        index: usize,
    ) -> [Vec<f64>; 2] {
        let grid = &contact.grid;
        let [nx, ny] = grid.cells();
        let mut traction = [vec![0.0; nx * ny], vec![0.0; nx * ny]];
        let low = [
            grid.x[0] - 0.5 * grid.step[0],
            grid.places[0].s - 0.5 * grid.step[1],
        ];
        let cells = [nx, grid.numbers[ny - 1] + 1];
        for part in parts {
            for k in 0..part.centres.len() {
                each_cell(part, k, index, |place, size, _, [x, y, _]| {
                    // The cells of the grid that this cell covers, and the covered part of each.
                    let [along, across] = [0, 1].map(|axis| {
                        let ends = [-0.5, 0.5].map(|half| {
                            (place[axis] + half * size[axis] - low[axis]) / grid.step[axis]
                        });
                        covered(ends, cells[axis])
                    });
                    for (number, height) in &across {
                        let Some(j) = grid.strip(*number as i64) else {
                            continue;
                        };
                        for (i, width) in &along {
                            let share = width * height;
                            traction[0][j * nx + i] += share * x;
                            traction[1][j * nx + i] += share * y;
                        }
                    }
                });
            }
        }
        traction
    }
}

/// Creepages and spin of the wheel above a point of the curve, at x in mm.
pub(super) fn creepages(
    rigid: &RigidMotion,
    x: f64,
    place: &CurvePlace,
    over: &WheelOver,
) -> Motion {
    let [creepage_x, creepage_y] = rigid.slip(place.point(x, over.gap), place);
    Motion {
        creepage_x,
        creepage_y,
        spin_per_mm: rigid.spin(place),
    }
}

/// Calls a function for every cell of a patch with its position `[x, s]` and size in mm, its area in mm², and in a motion its tractions and pressure
/// `[q_x, q_s, p]` in MPa.
pub(super) fn each_cell(
    part: &Part,
    patch: usize,
    index: usize,
    mut call: impl FnMut([f64; 2], [f64; 2], f64, [f64; 3]),
) {
    let (motion, level) = &part.motions[index];
    let (Some(fields), Some(level)) = (&motion.fields, level) else {
        return;
    };
    let (mesh, unit) = (&level.mesh, level.scale.traction);
    let traction = &fields.tangential.traction;
    for segment in mesh.segments.iter().filter(|s| s.chord.patch == patch) {
        let (y, dy) = (segment.chord.y, segment.chord.dy);
        for i in segment.cells.clone() {
            let x = 0.5 * (mesh.left[i] + mesh.right[i]);
            let size = [mesh.right[i] - mesh.left[i], dy];
            let [q_x, q_s] = [0, 1].map(|axis| unit * traction[axis][i]);
            let place = [x + part.origin[0], y + part.origin[1]];
            call(
                place,
                size,
                size[0] * size[1],
                [q_x, q_s, level.pressure[i]],
            );
        }
    }
}

/// The cells between two positions, which are counted in cells, and the part of each that lies between them.
fn covered([from, to]: [f64; 2], cells: usize) -> Vec<(usize, f64)> {
    let [first, last] = [from, to].map(|end| (end.max(0.0).floor() as usize).min(cells - 1));
    let part = |cell: usize| to.min(cell as f64 + 1.0) - from.max(cell as f64);
    (first..=last)
        .map(|cell| (cell, part(cell)))
        .filter(|(_, part)| *part > 0.0)
        .collect()
}
