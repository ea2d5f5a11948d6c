//! Traction bounds that depend on the path of a point through the contact: heat, and plastic shear of the layer between the bodies.
//!
//! Along a strip every bound follows from the slips of its own cell and of the cells ahead, where the point has been. The method solves with given
//! bounds, finds the bounds that belong to the slips, and repeats until they agree.

use crate::friction::coefficient_table::CoefficientTable;
use crate::friction::velocity_weakening::SLIP_OF_CELL;
use crate::mesh::Mesh;
use crate::numerics::roots::{self, CloseEnough, Course};

/// Tolerance of the temperature of a cell in K. Bounds change by about 10⁻⁴ per K. Not tuned.
const KELVIN: f64 = 1e-6;

/// A coefficient that decreases with the temperature of the contact.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatedLaw {
    /// Temperatures in °C, rising, with coefficients that never rise.
    table: CoefficientTable,
    /// Temperature in °C without friction heat.
    base: f64,
    /// Temperature rise in K at a rolling speed of 1 mm/s per unit of `∫ q/√(x′ − x) dx′`, with q in MPa times relative slip and lengths in mm.
    /// It is proportional to the root of the speed.
    rise: f64,
}

impl HeatedLaw {
    /// Makes a law from increasing temperatures with as many non-increasing coefficients, at least one. See the fields for `base` and `rise`.
    pub fn new(at: &[f64], coefficient: &[f64], base: f64, rise: f64) -> HeatedLaw {
        HeatedLaw {
            table: CoefficientTable::new(at, coefficient),
            base,
            rise,
        }
    }

    /// The coefficient of the coldest contact, which is the largest one.
    pub fn largest(&self) -> f64 {
        self.table.largest()
    }

    /// Temperature rise in K per unit of heating at a rolling speed in mm/s.
    fn rise_at(&self, speed: f64) -> f64 {
        self.rise * speed.sqrt()
    }

    /// Stability number `1.7 max|dμ/dT| (dT/ds) p_max/G` at a rolling speed in mm/s. dT/ds is the largest temperature rise per relative slip of a
    /// patch with this half-length in mm. It compares the decrease of bounds with slip with the decrease of slips with traction.
    pub fn stability(
        &self,
        speed: f64,
        pressure_max: f64,
        half_length: f64,
        shear_modulus: f64,
    ) -> f64 {
        let slope = |pair: &[(f64, f64)]| (pair[0].1 - pair[1].1) / (pair[1].0 - pair[0].0);
        let steepest = self
            .table
            .points()
            .windows(2)
            .map(slope)
            .fold(0.0, f64::max);
        // The largest value of ∫ √(1 − s²)/√(s − ξ) ds is 2.188.
        let rise = self.rise_at(speed) * self.largest() * pressure_max * 2.188 * half_length.sqrt();
        SLIP_OF_CELL * steepest * rise * pressure_max / shear_modulus
    }
}

/// The path-dependent laws of one motion.
#[derive(Debug, Clone, Copy)]
pub struct PathDependentLaws<'a> {
    /// A coefficient that decreases with the temperature, and the rolling speed in mm/s.
    pub heated: Option<(&'a HeatedLaw, f64)>,
    /// The yield of the layer between the bodies.
    pub yielding: Option<LayerYield>,
}

impl<'a> PathDependentLaws<'a> {
    /// The laws in the units of a mesh: of slip, of length in mm and of traction in MPa.
    pub fn on_level(&self, slip: f64, length: f64, traction: f64) -> PathDependentFriction<'a> {
        PathDependentFriction {
            heated: self.heated.map(|(law, speed)| CellHeat {
                law,
                rise: law.rise_at(speed) * traction * slip * length.sqrt(),
            }),
            yielding: self.yielding.map(|law| LayerYield {
                stress: law.stress / traction,
                hardening: law.hardening * slip * length / traction,
            }),
        }
    }
}

/// Path-dependent laws for dimensionless bounds and slips.
#[derive(Debug, Clone, Copy)]
pub struct PathDependentFriction<'a> {
    heated: Option<CellHeat<'a>>,
    yielding: Option<LayerYield>,
}

/// A law with the temperature rise in K per dimensionless heating.
#[derive(Debug, Clone, Copy)]
struct CellHeat<'a> {
    law: &'a HeatedLaw,
    rise: f64,
}

/// Heat of cells along a strip, from the leading end.
#[derive(Debug, Default)]
struct Heated {
    /// Trailing edge, leading edge and heat of each cell.
    cells: Vec<(f64, f64, f64)>,
}

impl Heated {
    /// `∫ q/√(x′ − x) dx′` of the cells so far.
    fn ahead(&self, x: f64) -> f64 {
        let of = |(near, far, heat): &(f64, f64, f64)| {
            2.0 * heat * ((far - x).sqrt() - (near - x).sqrt())
        };
        self.cells.iter().map(of).sum()
    }
}

impl PathDependentFriction<'_> {
    /// The bounds that belong to the slips of the first cells of a mesh. `rest` has the bounds of a cold contact whose layer does not yield. Cells
    /// that stick have the slip 0.
    pub fn bounds(&self, mesh: &Mesh, rest: &[f64], slip: &[f64]) -> Vec<f64> {
        let mut bounds = rest.to_vec();
        let mut heated = Heated::default();
        let (mut strip, mut plastic) = (None, 0.0);
        // The segments of a strip are in order from its trailing end. A point passes them from its leading end.
        let segments = mesh.segments.iter().rev();
        for segment in segments.filter(|segment| segment.cells.end <= slip.len()) {
            let of = (segment.chord.patch, segment.chord.strip);
            if strip.replace(of) != Some(of) {
                heated.cells.clear();
                plastic = 0.0;
            }
            for i in segment.cells.clone().rev() {
                let (left, right) = (mesh.left[i], mesh.right[i]);
                if let Some(heat) = self.heated {
                    let ahead = heated.ahead(0.5 * (left + right));
                    bounds[i] = heat.bound(rest[i], slip[i], ahead, right - left);
                }
                if let Some(law) = self.yielding {
                    // If friction is weaker than the layer, the surface slides on the layer, which does not yield.
                    let room = match law.hardening > 0.0 {
                        true => (bounds[i] - law.stress) / law.hardening - plastic,
                        false if law.stress < bounds[i] => f64::INFINITY,
                        false => 0.0,
                    };
                    let grown = (slip[i] * (right - left)).min(room.max(0.0));
                    let stress = law.stress + law.hardening * (plastic + 0.5 * grown);
                    bounds[i] = bounds[i].min(stress);
                    plastic += grown;
                }
                heated.cells.push((left, right, bounds[i] * slip[i]));
            }
        }
        bounds
    }
}

impl CellHeat<'_> {
    /// The bound of a cell at its temperature, from the heat of the cells ahead and its own.
    fn bound(&self, rest: f64, slip: f64, ahead: f64, length: f64) -> f64 {
        let largest = self.law.largest();
        let fixed = self.law.base + self.rise * ahead;
        // Only the heat of the leading half of the cell reaches its middle.
        let own = self.rise * 2.0 * (0.5 * length).sqrt() * rest * slip / largest;
        let hottest = fixed + own * largest;
        let close = CloseEnough {
            value: 0.0,
            place: KELVIN,
        };
        let temperature = match own > 0.0 {
            true => roots::find([fixed, hottest], hottest, Course::Rising, close, |t| {
                let (mu, slope) = self.law.table.at(t);
                [t - fixed - own * mu, 1.0 - own * slope]
            }),
            false => fixed,
        };
        rest * self.law.table.at(temperature).0 / largest
    }
}

/// The interface of the two surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interface {
    /// Kalker's reduction factor k, more than 0 and at most 1. Tractions displace the surfaces 1/k times as far.
    pub reduction: f64,
    /// Flexibility of an elastic layer in mm³/N, its thickness over its shear modulus; 0 without a layer. The displacement difference of the
    /// surfaces grows by this times the local traction.
    pub layer: f64,
    /// The yield of the layer, if it yields.
    pub yielding: Option<LayerYield>,
}

/// The yield of a layer, which transmits at most a stress that grows with its plastic shear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerYield {
    /// Shear stress in MPa at which it begins to yield.
    pub stress: f64,
    /// Increase of that stress in MPa per mm of plastic displacement, not negative.
    pub hardening: f64,
}

impl Default for Interface {
    /// Clean surfaces.
    fn default() -> Self {
        Interface {
            reduction: 1.0,
            layer: 0.0,
            yielding: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Chord;
    use crate::mesh::Grading;

    fn strip(cells: usize) -> Mesh {
        let chord = Chord {
            patch: 0,
            strip: 0,
            y: 0.0,
            dy: 1.0,
            left: -1.0,
            right: 1.0,
        };
        Mesh::new(&[chord], &Grading::cosine(cells))
    }

    /// With μ = 1 − c T and uniform pressure and slip, T = R s ∫ μ/√(x′ − x) dx′. The solution is μ = exp(z²) erfc(z) with z = c R s √(π d) at the
    /// distance d from the leading end (Abel's equation of the second kind).
    #[test]
    fn uniform_slip_heats_as_abels_equation_says() {
        let law = HeatedLaw::new(&[0.0, 1000.0], &[1.0, 0.0], 0.0, 1.0);
        let laws = PathDependentLaws {
            heated: Some((&law, 1.0)),
            yielding: None,
        };
        let mesh = strip(80);
        let slip = 400.0;
        let (rest, slips) = (vec![1.0; 80], vec![slip; 80]);
        let found = laws.on_level(1.0, 1.0, 1.0).bounds(&mesh, &rest, &slips);
        // exp(z²) erfc(z) at z = 0.2, 0.5 and 0.8.
        for (z, known) in [
            (0.2_f64, 0.809_019_54),
            (0.5, 0.615_690_34),
            (0.8, 0.489_100_58),
        ] {
            let distance = (z / (1e-3 * slip)).powi(2) / std::f64::consts::PI;
            let middles: Vec<f64> = (0..80)
                .map(|i| 1.0 - 0.5 * (mesh.left[i] + mesh.right[i]))
                .collect();
            let k = middles.iter().position(|d| *d <= distance).expect("inside");
            let part = (distance - middles[k]) / (middles[k - 1] - middles[k]);
            let between = found[k] + part * (found[k - 1] - found[k]);
            assert!((between - known).abs() < 2e-3, "{z}: {between} {known}");
        }
    }

    #[test]
    fn a_layer_hardens_by_the_slip_ahead_until_friction_holds_less() {
        let laws = PathDependentLaws {
            heated: None,
            yielding: Some(LayerYield {
                stress: 0.5,
                hardening: 0.25,
            }),
        };
        let mesh = strip(40);
        let found = laws
            .on_level(1.0, 1.0, 1.0)
            .bounds(&mesh, &[0.8; 40], &[1.0; 40]);
        for (i, bound) in found.iter().enumerate() {
            let way = 1.0 - 0.5 * (mesh.left[i] + mesh.right[i]);
            let known = (0.5 + 0.25 * way).min(0.8);
            // The layer stops hardening inside one cell, whose bound is the mean over the cell.
            let within = if known > 0.78 { 0.011 } else { 1e-12 };
            assert!((bound - known).abs() < within, "{i}: {bound} {known}");
        }
        // Without slip, the whole layer keeps its initial strength.
        let still = laws
            .on_level(1.0, 1.0, 1.0)
            .bounds(&mesh, &[0.8; 40], &[0.0; 40]);
        assert!(still.iter().all(|bound| *bound == 0.5));
    }
}
