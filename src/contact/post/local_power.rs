//! Friction power of each cell, and the flash temperature.
//!
//! **Power.** For tractions that are constant in every cell, `∬ T·∂u/∂x dA` of their exact displacements is 0, because the x-derivative of the
//! influence is odd. The *mean* slip of a cell follows from the displacements at its two **edges**:
//! `s̄ = w + [u(leading edge) − u(trailing edge)]/h`. The powers `A T·s̄` then add up to `ν_x F_x + ν_y F_y + φ M_z` for any method. Strips of
//! different widths are evaluated at their mid-lines only, which breaks the symmetry by about 0.1 %. Half of the derivative minus half of its
//! transpose restores it to rounding.
//!
//! **Temperature.** Heat flows only into the depth and the contact passes quickly (large Péclet number). Every line along rolling is therefore a
//! half-space heated from its leading edge: `θ(x) = 1/(B√(πV)) ∫_x^lead q(x′)/√(x′ − x) dx′` with the heat q per area and time and `B = β₁ + β₂`,
//! `β = √(λρc)` of each body. Both surfaces have the same temperature in the contact. Without heat it is the mean of the bulk temperatures weighted
//! with β. The heat is shared in the same proportion (Jaeger 1942; Carslaw and Jaeger 1959, §2.4 and 10.7).

use std::ops::Range;

use crate::case::words::material::{Thermal, ThermalBodyWords};
use crate::half_space::strip_operator::assembly::{CellEdges, SegmentRows};
use crate::half_space::strip_operator::kind::Precision;
use crate::mesh::{Mesh, Segment};
use crate::method::Method;
use crate::monitor::{Monitor, Stop};
use crate::normal::footprint::Footprint;
use crate::numerics::simd;
use crate::numerics::simd::Float;
use crate::rolling::answer::LevelAnswer;
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::Motion;

/// A motion that is solved on a mesh.
#[derive(Debug, Clone, Copy)]
pub struct SolvedMotion<'a> {
    /// The loaded region.
    pub footprint: &'a Footprint,
    /// The mesh.
    pub level: &'a StripMesh,
    /// Tractions, slips and zones on it.
    pub answer: &'a LevelAnswer,
    /// The motion, about the origin of the case.
    pub motion: &'a Motion,
    /// The method of the tractions.
    pub method: Method,
    /// Rolling speed in mm/s, if it is known.
    pub speed: Option<f64>,
}

/// Power and slip of every cell, over the rolling speed.
#[derive(Debug, Clone, PartialEq)]
pub struct CellPower {
    /// Friction power in N.
    pub power: Vec<f64>,
    /// Longitudinal and lateral slip.
    pub slip: [Vec<f64>; 2],
}

/// Computes the power of every cell, and its slip in the direction of the traction that corresponds to the power. The powers of a patch are
/// scaled to its total, which is the friction power over the rolling speed in N.
///
/// The power of a cell that sticks or whose power is negative is moved to the cell behind it, in the direction of the material. The last cell of a
/// strip keeps it: even if it sticks, it slips at its trailing end. Cells without traction have the slip of the method.
///
/// # Errors
/// Returns an error if the monitor, which is called once per strip, stops the work.
pub fn cell_power(
    of: SolvedMotion,
    totals: &[f64],
    monitor: &dyn Monitor,
) -> Result<CellPower, Stop> {
    let (level, answer) = (of.level, of.answer);
    let unit = level.scale.slip();
    let mut slip = [0, 1].map(|k| answer.slip[k].iter().map(|s| s * unit).collect::<Vec<_>>());
    if answer.is_without_traction() {
        let power = vec![0.0; level.area.len()];
        return Ok(CellPower { power, slip });
    }
    let power = powers(of, totals, monitor)?;
    for (i, power) in power.iter().enumerate() {
        let traction = [0, 1].map(|k| answer.traction[k][i] * level.scale.traction);
        let length = traction[0].hypot(traction[1]);
        if length > 0.0 {
            let size = power / (level.area[i] * length);
            for k in [0, 1] {
                slip[k][i] = size * traction[k] / length;
            }
        }
    }
    Ok(CellPower { power, slip })
}

/// Power of every cell over the rolling speed, in N.
fn powers(of: SolvedMotion, totals: &[f64], monitor: &dyn Monitor) -> Result<Vec<f64>, Stop> {
    let (level, answer) = (of.level, of.answer);
    let is_in_every_patch = |power: &[f64]| {
        let of_patch = |patch| power[level.patch_cells(patch)].iter().sum::<f64>();
        (0..totals.len()).all(|patch| of_patch(patch) > 0.0)
    };
    let mut power = match of.method {
        // The simplified theory has its own displacements and slips. If nothing slips, it does not determine the distribution of the power.
        Method::Fastsim => match own_powers(level, answer) {
            own if is_in_every_patch(&own) => own,
            _ => cell_mean_powers(of, monitor)?,
        },
        // The table has no cells, so that it is never used here.
        Method::BoundaryElement | Method::LiuHsu | Method::Table => cell_mean_powers(of, monitor)?,
    };
    for segment in &level.mesh.segments {
        carry(&mut power, &answer.slips, segment.cells.clone());
    }
    for (patch, total) in totals.iter().enumerate() {
        let power = &mut power[level.patch_cells(patch)];
        power.iter_mut().for_each(|power| *power = power.max(0.0));
        let sum: f64 = power.iter().sum();
        // A power that is not positive is an error of the resultants. Then all cells have the power 0.
        let factor = if sum > 0.0 { total.max(0.0) / sum } else { 0.0 };
        power.iter_mut().for_each(|power| *power *= factor);
    }
    Ok(power)
}

/// Traction times slip of the method.
fn own_powers(level: &StripMesh, answer: &LevelAnswer) -> Vec<f64> {
    let of_cell = |i: usize| {
        let [x, y] = [0, 1].map(|k| answer.traction[k][i] * answer.slip[k][i]);
        (x + y) * level.area[i]
    };
    (0..level.area.len()).map(of_cell).collect()
}

/// Traction times mean slip on a mesh, up to a common factor.
fn cell_mean_powers(of: SolvedMotion, monitor: &dyn Monitor) -> Result<Vec<f64>, Stop> {
    let (level, traction) = (of.level, &of.answer.traction);
    let (mesh, nu) = (&level.normalised, level.poisson_ratio);
    let mut power = rigid_powers(mesh, &level.scale.motion(of.motion), traction);
    if let Some([x, y]) = &level.surface_slip {
        let areas = mesh.areas();
        for (i, power) in power.iter_mut().enumerate() {
            *power += areas[i] * (traction[0][i] * x[i] + traction[1][i] * y[i]);
        }
    }
    let differences = match level.precision {
        Precision::Single => Differences::of::<f32>(mesh, nu, traction, monitor)?,
        Precision::Double => Differences::of::<f64>(mesh, nu, traction, monitor)?,
    };
    differences.add_powers(mesh, traction, &mut power);
    add_layer_powers(mesh, level.layer, traction, &mut power);
    Ok(power)
}

/// Adds traction times the mean slip of an elastic layer. Its displacement at an edge follows from the mean of the two adjacent tractions, and is 0
/// at the ends of a strip. The sum is 0.
fn add_layer_powers(mesh: &Mesh, flexibility: f64, traction: &[Vec<f64>; 2], power: &mut [f64]) {
    if flexibility == 0.0 {
        return;
    }
    for segment in &mesh.segments {
        let last = segment.cells.end - 1;
        for i in segment.cells.clone() {
            for t in traction {
                let ahead = if i < last { t[i + 1] } else { 0.0 };
                let behind = if i > segment.cells.start {
                    t[i - 1]
                } else {
                    0.0
                };
                power[i] += 0.5 * flexibility * segment.chord.dy * t[i] * (ahead - behind);
            }
        }
    }
}

/// `A T·w` of a motion.
fn rigid_powers(mesh: &Mesh, motion: &Motion, traction: &[Vec<f64>; 2]) -> Vec<f64> {
    let mut power = Vec::with_capacity(mesh.cells());
    for (segment, load_y) in mesh.segments.iter().zip(&mesh.load_y) {
        // The resultants use the same lever arm.
        let y = 0.5 * (segment.chord.y + load_y);
        for i in segment.cells.clone() {
            let x = 0.5 * (mesh.left[i] + mesh.right[i]);
            let area = (mesh.right[i] - mesh.left[i]) * segment.chord.dy;
            let along = motion.creepage_x - motion.spin_per_mm * y;
            let across = motion.creepage_y + motion.spin_per_mm * x;
            power.push(area * (traction[0][i] * along + traction[1][i] * across));
        }
    }
    power
}

/// `D T` and `Dᵀ dy T`, longitudinal and lateral.
struct Differences {
    applied: [Vec<f64>; 2],
    transposed: [Vec<f64>; 2],
}

impl Differences {
    /// Computes the rows of `D` strip by strip, without storing them.
    fn of<T: Float + Into<f64>>(
        mesh: &Mesh,
        nu: f64,
        traction: &[Vec<f64>; 2],
        monitor: &dyn Monitor,
    ) -> Result<Differences, Stop> {
        let cells = mesh.cells();
        let zeros = || [vec![0.0; cells], vec![0.0; cells]];
        let mut sums = Differences {
            applied: zeros(),
            transposed: zeros(),
        };
        let mut edges = CellEdges::<T>::new(mesh);
        let mut rows = Vec::new();
        for segment in &mesh.segments {
            monitor.go_on(0.0)?;
            rows.resize(3 * cells * segment.cells.len(), T::ZERO);
            edges.observe_from(mesh, segment.chord.y);
            simd::dispatch(SegmentRows {
                reversible: false,
                edges: &mut edges,
                points: &edges_of(mesh, segment),
                mesh,
                nu,
                folded: false,
                stride: cells,
                target: &mut rows,
            });
            sums.add(segment, &rows, traction);
        }
        Ok(sums)
    }

    /// Adds `½ dy T·(D T) − ½ T·(Dᵀ dy T)`.
    fn add_powers(&self, mesh: &Mesh, traction: &[Vec<f64>; 2], power: &mut [f64]) {
        for segment in &mesh.segments {
            for i in segment.cells.clone() {
                for (k, traction) in traction.iter().enumerate() {
                    let own = segment.chord.dy * self.applied[k][i];
                    power[i] += 0.5 * traction[i] * (own - self.transposed[k][i]);
                }
            }
        }
    }

    fn add<T: Float + Into<f64>>(
        &mut self,
        segment: &Segment,
        rows: &[T],
        traction: &[Vec<f64>; 2],
    ) {
        let cells = traction[0].len();
        let [tx, ty] = [&traction[0][..cells], &traction[1][..cells]];
        let [back_x, back_y] = &mut self.transposed;
        let (back_x, back_y) = (&mut back_x[..cells], &mut back_y[..cells]);
        for (row, i) in rows.chunks_exact(3 * cells).zip(segment.cells.clone()) {
            let (xx, rest) = row.split_at(cells);
            let (xy, yy) = rest.split_at(cells);
            let [own_x, own_y] = [0, 1].map(|k| segment.chord.dy * traction[k][i]);
            let mut sum = [0.0; 2];
            for k in 0..cells {
                let (xx, xy, yy): (f64, f64, f64) = (xx[k].into(), xy[k].into(), yy[k].into());
                sum[0] += xx * tx[k] + xy * ty[k];
                sum[1] += xy * tx[k] + yy * ty[k];
                back_x[k] += xx * own_x + xy * own_y;
                back_y[k] += xy * own_x + yy * own_y;
            }
            for k in [0, 1] {
                self.applied[k][i] = sum[k];
            }
        }
    }
}

/// The edges of the cells of a segment, from its trailing to its leading end.
fn edges_of(mesh: &Mesh, segment: &Segment) -> Vec<f64> {
    let cells = segment.cells.clone();
    let last = mesh.right[cells.end - 1];
    let mut edges = mesh.left[cells].to_vec();
    edges.push(last);
    edges
}

/// Moves the power of cells that stick or whose power is negative to the cell behind, beginning at the leading cell. A negative power at the trailing
/// end is balanced by the cells ahead. The sum is preserved, and if it is not negative, neither is any cell.
fn carry(power: &mut [f64], slips: &[bool], cells: Range<usize>) {
    let mut carried = 0.0;
    for i in cells.clone().rev() {
        power[i] += carried;
        carried = 0.0;
        let last = i == cells.start;
        if !last && (!slips[i] || power[i] < 0.0) {
            carried = std::mem::take(&mut power[i]);
        }
    }
    let mut debt = 0.0;
    for i in cells.clone() {
        power[i] += debt;
        debt = 0.0;
        if power[i] < 0.0 && i + 1 < cells.end {
            debt = std::mem::take(&mut power[i]);
        }
    }
}

impl ThermalBodyWords {
    /// Thermal penetration coefficient β in J/(m² √s K).
    pub fn penetration(&self) -> f64 {
        (self.conductivity_w_per_mk * self.density_kg_per_m3 * self.specific_heat_j_per_kgk).sqrt()
    }

    /// Péclet number `V L/(2 κ)` of a contact of half-length L in mm at the rolling speed V in mm/s.
    pub fn peclet(&self, speed: f64, half_length: f64) -> f64 {
        let diffusivity =
            self.conductivity_w_per_mk / (self.density_kg_per_m3 * self.specific_heat_j_per_kgk);
        speed * METRES * half_length * METRES / (2.0 * diffusivity)
    }
}

impl Thermal {
    /// Share of the friction heat that flows into the lower body while it is in contact.
    pub fn share_of_lower(&self) -> f64 {
        let [lower, upper] = self.bodies().map(ThermalBodyWords::penetration);
        lower / (lower + upper)
    }

    /// Temperature of both surfaces in the contact without friction heat, in °C.
    pub fn without_heat(&self) -> f64 {
        let (share, [lower, upper]) = (self.share_of_lower(), self.bodies());
        share * lower.bulk_c + (1.0 - share) * upper.bulk_c
    }

    /// Temperature rise in K per unit of [`heating`], at a speed in mm/s: lengths in mm and heat in MPa mm/s give `1000 √0.001`.
    pub fn rise_of(&self, speed: f64) -> f64 {
        let [lower, upper] = self.bodies().map(ThermalBodyWords::penetration);
        // MPa mm/s are 1000 W/m².
        1e3 * METRES.sqrt() / ((lower + upper) * (std::f64::consts::PI * speed * METRES).sqrt())
    }
}

/// Computes `∫ q(x′)/√(x′ − x) dx′` ahead of every point x, for heat that is linear in every cell of a line.
///
/// `edges` has one value more than `heat`, from the trailing to the leading end. `heat` has the means of the cells. Slopes follow from the neighbours.
/// They are 0 at extrema and at most twice the one-sided ones, so that no cell has a negative heat.
pub fn heating(edges: &[f64], heat: &[f64], points: &[f64]) -> Vec<f64> {
    let slopes = slopes(edges, heat);
    let at = |x: f64| {
        let mut sum = 0.0;
        for k in 0..heat.len() {
            let (near, far) = (
                (edges[k] - x).max(0.0).sqrt(),
                (edges[k + 1] - x).max(0.0).sqrt(),
            );
            if far == 0.0 {
                continue;
            }
            let middle = 0.5 * (edges[k] + edges[k + 1]);
            let cubes = 2.0 / 3.0 * (far.powi(3) - near.powi(3));
            let linear = cubes + 2.0 * (x - middle) * (far - near);
            sum += 2.0 * heat[k] * (far - near) + slopes[k] * linear;
        }
        sum
    };
    points.iter().map(|x| at(*x)).collect()
}

/// Limited slopes of cell means. Beyond both ends the heat is 0.
fn slopes(edges: &[f64], heat: &[f64]) -> Vec<f64> {
    let n = heat.len();
    let middle = |k: usize| 0.5 * (edges[k] + edges[k + 1]);
    (0..n)
        .map(|k| {
            let before = match k.checked_sub(1) {
                Some(j) => (heat[k] - heat[j]) / (middle(k) - middle(j)),
                None => heat[k] / (middle(k) - edges[0]),
            };
            let after = if k + 1 < n {
                (heat[k + 1] - heat[k]) / (middle(k + 1) - middle(k))
            } else {
                -heat[k] / (edges[n] - middle(k))
            };
            if before * after <= 0.0 {
                return 0.0;
            }
            let central = 0.5 * (before + after);
            let limit = 2.0 * before.abs().min(after.abs());
            central.signum() * central.abs().min(limit)
        })
        .collect()
}

/// A millimetre in m.
pub(crate) const METRES: f64 = 1e-3;
/// A millimetre in nm.
pub(crate) const NANOMETRES: f64 = 1e6;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Chord;
    use crate::mesh::{Grading, strips_about};
    use crate::monitor::Unmonitored;

    /// For any tractions, the powers of the cells add up to the power of the forces, on strips of equal and of different widths.
    #[test]
    fn cell_means_add_up_to_the_power_of_the_forces() {
        let motion = Motion {
            creepage_x: 0.3,
            creepage_y: -0.1,
            spin_per_mm: 0.25,
        };
        for pole in [0.0, 0.6] {
            let strips = strips_about(pole, -1.5, 1.5, 6).into_iter().enumerate();
            let chord = |(strip, (y, dy)): (usize, (f64, f64))| {
                let half = (1.0 - (y / 1.5).powi(2)).sqrt();
                let (left, right) = (-half, half);
                Chord {
                    patch: 0,
                    strip,
                    y,
                    dy,
                    left,
                    right,
                }
            };
            let chords: Vec<Chord> = strips.map(chord).collect();
            let mesh = Mesh::new(&chords, &Grading::about(pole, 7));
            let traction = [1.0, 2.3].map(|seed| {
                let of_cell = |i: usize| (seed * (1.0 + 3.7 * i as f64)).sin();
                (0..mesh.cells()).map(of_cell).collect::<Vec<f64>>()
            });
            let rigid = rigid_powers(&mesh, &motion, &traction);
            let known: f64 = rigid.iter().sum();
            for single in [true, false] {
                let mut power = rigid.clone();
                let differences = match single {
                    true => Differences::of::<f32>(&mesh, 0.28, &traction, &Unmonitored),
                    false => Differences::of::<f64>(&mesh, 0.28, &traction, &Unmonitored),
                };
                differences
                    .unwrap()
                    .add_powers(&mesh, &traction, &mut power);
                let moved: f64 = power.iter().zip(&rigid).map(|(a, b)| (a - b).abs()).sum();
                let sum: f64 = power.iter().sum();
                assert!((sum - known).abs() < 1e-13 * moved, "{pole}: {sum} {known}");
                assert!(moved > known.abs(), "elastic slip counts: {moved}");
            }
        }
    }

    #[test]
    fn powers_are_carried_backwards_and_their_sum_is_kept() {
        let slips = [true, true, true, false, false];
        let mut power = [0.5, -0.2, 0.4, 0.1, -0.3];
        carry(&mut power, &slips, 0..5);
        for (found, known) in power.iter().zip([0.3, 0.0, 0.2, 0.0, 0.0]) {
            assert!((found - known).abs() < 1e-15, "{power:?}");
        }
        // A strip that sticks has its power at the trailing end. A negative power there is balanced from ahead.
        let mut power = [-0.5, 0.3, 0.4];
        carry(&mut power, &[false; 3], 0..3);
        assert!((power[0] - 0.2).abs() < 1e-15 && power[1..] == [0.0, 0.0]);
        let mut power = [-0.5, 0.3, 0.4];
        carry(&mut power, &[true; 3], 0..3);
        assert!(power[0] == 0.0 && power[1] == 0.0 && (power[2] - 0.2).abs() < 1e-15);
    }
}

#[cfg(test)]
mod heat_tests {
    use super::*;
    use crate::mesh::Grading;

    /// Golden values of constant heat per cell: the slopes are 0 where neighbours do not change.
    #[test]
    fn a_uniform_source_heats_as_a_root() {
        let edges = [-1.0, -0.4, 0.1, 1.0];
        for x in [-1.0, -0.7, 0.0, 0.5, 0.99] {
            // The inner slopes are 0 because the neighbours are equal, and the outer ones because they are extrema.
            let found = heating(&edges, &[3.0, 3.0, 3.0], &[x])[0];
            let known = 2.0 * 3.0 * (1.0 - x).sqrt();
            assert!((found - known).abs() < 1e-12, "{x}: {found} {known}");
        }
    }

    /// The heat of Hertz's pressure under uniform slip, `√(1 − s²)`, has the maximum 2.18831 at −0.6522, and the value 4√2/3 at the trailing end.
    #[test]
    fn a_semi_elliptic_source_has_its_known_peak() {
        let edges = Grading::cosine(40).edges;
        let area = |x: f64| 0.5 * (x * (1.0 - x * x).max(0.0).sqrt() + x.asin());
        let heat: Vec<f64> = edges
            .windows(2)
            .map(|e| (area(e[1]) - area(e[0])) / (e[1] - e[0]))
            .collect();
        let found = heating(&edges, &heat, &[-0.6522, -1.0]);
        assert!((found[0] - 2.18831).abs() < 2e-3, "{found:?}");
        assert!(
            (found[1] - 4.0 * 2.0_f64.sqrt() / 3.0).abs() < 3e-3,
            "{found:?}"
        );
    }

    /// Far behind a short source, the heat is that of a point: `q h/√distance`.
    #[test]
    fn a_short_source_acts_as_a_point() {
        let found = heating(&[0.0, 1e-3], &[5.0], &[-4.0])[0];
        assert!((found / (5.0 * 1e-3 / 2.0) - 1.0).abs() < 1e-3, "{found}");
    }

    #[test]
    fn bodies_without_slip_meet_in_the_middle() {
        let steel = |bulk_c| ThermalBodyWords {
            conductivity_w_per_mk: 50.0,
            density_kg_per_m3: 7850.0,
            specific_heat_j_per_kgk: 450.0,
            bulk_c,
        };
        let task = Thermal::Pair {
            lower: steel(120.0),
            upper: steel(20.0),
        };
        assert!((task.without_heat() - 70.0).abs() < 1e-12);
        assert!((steel(0.0).penetration() - 13290.0).abs() < 1.0);
        // 0.3 · 770.5 MPa · 1 m/s of slip over 2a = 11.7578 mm at 30 m/s: 150.3 K.
        let heat = 0.3 * 770.5 * 1000.0;
        let rise = task.rise_of(30_000.0) * heat * 2.18831 * 5.8789_f64.sqrt();
        assert!((rise - 150.3).abs() < 0.2, "{rise}");
    }
}
