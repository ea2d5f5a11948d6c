//! The tangential problem of one footprint: physics, motions, method and accuracy.

use railhead_macros::{Finite, Words, keyword};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::friction::law::FrictionLaw;
use crate::friction::path_dependent::{Interface, PathDependentLaws};
use crate::friction::velocity_weakening::Softening;
use crate::half_space::strip_operator::kind::Precision;
use crate::half_space::unlike_bodies::Elasticity;
use crate::mesh::MeshSize;
use crate::method::{Method, TractionBound};
use crate::normal::footprint::Footprint;

/// Least target at which operators have single precision. Chosen by judgement.
const SINGLE_PRECISION_FROM: f64 = 5e-4;

/// Residual to reach over the target error. Chosen by judgement.
const RESIDUAL_OF_TARGET: f64 = 0.04;
/// Tolerance of a prescribed force over the target error. Chosen by judgement.
pub(crate) const SHARE_OF_TARGET: f64 = 0.02;
/// Largest residual that a target allows, relative to the traction scale. Chosen by judgement.
const TOLERANCE_LARGEST: f64 = 4e-4;

/// Residual of the friction law, relative to the traction scale, on a mesh given by the client.
pub const TOLERANCE_LEAST: f64 = 1e-6;

/// The motions to solve on one footprint, with the physics and the method.
#[derive(Debug, Clone, Copy)]
pub struct RollingTask<'a> {
    /// Patches and pressures.
    pub footprint: &'a Footprint,
    /// Elastic constants of the pair.
    pub elasticity: &'a Elasticity,
    /// Friction law, which bounds the tractions.
    pub friction: &'a FrictionLaw,
    /// Interface between the bodies.
    pub interface: Interface,
    /// The motions, in order; a creepage is 0 where a force is prescribed instead.
    pub motions: &'a [Motion],
    /// Forces prescribed instead of creepages, motion by motion.
    pub forces: &'a [PrescribedForces],
    /// Rolling speeds in mm/s, motion by motion; `None` where unknown.
    pub speeds: &'a [Option<f64>],
    /// Number of the first of these motions in its case.
    pub first_motion: usize,
    /// The method.
    pub method: Method,
    /// Traction bound at which `fastsim` slips.
    pub traction_bound: TractionBound,
    /// Target error or mesh.
    pub resolution: Resolution,
    /// Whether smooth slips are needed. Forces do not depend on it.
    pub wants_slips: bool,
    /// Whether the table gives derivatives, which take six times as long as its values.
    pub wants_gradients: bool,
    /// Whether resultants of neighbouring motions are subtracted from each other, which requires smaller residuals.
    pub is_differenced: bool,
}

impl RollingTask<'_> {
    /// The target error of the resultants; `None` for an explicit mesh.
    pub fn target(&self) -> Option<f64> {
        self.resolution.target()
    }

    /// The residual to reach for motion `index`. It is far below the target; a smaller one would not improve the answer.
    pub fn tolerance(&self, index: usize) -> f64 {
        let is_prescribed =
            self.is_differenced || self.forces.get(index).is_some_and(|f| *f != [None; 2]);
        match self.resolution {
            Resolution::Target(target) => {
                let part = if is_prescribed {
                    // The search for a force sees the residual as noise.
                    NEGLIGIBLE_OF_TARGET * SHARE_OF_TARGET
                } else {
                    RESIDUAL_OF_TARGET
                };
                (part * target).clamp(TOLERANCE_LEAST, TOLERANCE_LARGEST)
            }
            Resolution::Mesh(_) => TOLERANCE_LEAST,
        }
    }

    /// The weakening of the friction bounds with slip in motion `index`, if there is any. Slips are in units of `slip_unit`.
    pub fn bound_fall(&self, index: usize, slip_unit: f64) -> Option<Softening> {
        let speed = self.speeds.get(index).copied().flatten();
        self.friction.bound_fall(speed, slip_unit)
    }

    /// The laws that change the friction bounds along the path through the contact in motion `index`, if there are any.
    pub fn passage(&self, index: usize) -> Option<PathDependentLaws<'_>> {
        let speed = self.speeds.get(index).copied().flatten();
        let laws = PathDependentLaws {
            heated: self.friction.heated().zip(speed),
            yielding: self.interface.yielding,
        };
        (laws.heated.is_some() || laws.yielding.is_some()).then_some(laws)
    }

    /// The reason why friction falls too fast with slip or temperature for a solution, if it does.
    pub fn falls_too_fast(&self) -> Option<String> {
        let modulus = self.interface.reduction * self.elasticity.shear_modulus;
        let patches = self.footprint.patches();
        let shear = (modulus, self.interface.layer);
        self.friction.too_fast(patches, shear, self.speeds)
    }

    /// The largest number of cells in a strip for which motion `index` has a steady state; see [`FrictionLaw::cells_along_max`].
    pub fn cells_along_max(&self, index: usize) -> f64 {
        let speed = self.speeds.get(index).copied().flatten();
        let patches = self.footprint.patches();
        self.friction
            .cells_along_max(patches, self.interface.layer, speed)
    }

    /// Whether the pressure causes slip because the bodies differ, and the method models it.
    pub fn is_coupled(&self) -> bool {
        self.elasticity.difference != 0.0 && self.method == Method::BoundaryElement
    }

    /// Whether a force is prescribed for any motion.
    pub fn has_prescribed_forces(&self) -> bool {
        self.forces.iter().any(|forces| *forces != [None; 2])
    }
}

/// Default target error of the resultants relative to μN. It also replaces the target of an explicit mesh where a search needs one.
pub const TARGET_USUAL: f64 = 0.005;
/// Errors below this part of the target are negligible.
pub(crate) const NEGLIGIBLE_OF_TARGET: f64 = 0.1;
/// Largest part of a target that a known error may take up; beyond it the target is not reduced by that error.
const ERROR_MAX: f64 = 0.95;

/// Least target error relative to μN; no mesh resolves less.
pub const TARGET_LEAST: f64 = 1e-4;

/// Reference quantity of a relative error.
#[keyword(Default, Words)]
pub enum RelativeTo {
    /// The friction limit μN.
    #[default]
    FrictionLimit,
    /// The tangential force of the motion, of all patches that share a frame.
    Force,
}

/// A mesh chosen by the solver for a target, or given by the client.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Resolution {
    /// Allowed error of the resultants relative to μN.
    Target(f64),
    /// An explicit mesh.
    Mesh(MeshSize),
}

impl Resolution {
    /// The target, if there is one.
    pub fn target(self) -> Option<f64> {
        match self {
            Resolution::Target(target) => Some(target),
            Resolution::Mesh(_) => None,
        }
    }

    /// The precision of the operators: single where its rounding errors are far below the target.
    pub fn precision(self) -> Precision {
        match self {
            Resolution::Target(target) if target >= SINGLE_PRECISION_FROM => Precision::Single,
            _ => Precision::Double,
        }
    }

    /// The target, or [`TARGET_USUAL`] for an explicit mesh.
    pub fn target_or_usual(self) -> f64 {
        self.target().unwrap_or(TARGET_USUAL)
    }

    /// The target reduced so that its root sum of squares with another error equals the original. It is unchanged if that error is 0, or larger than the part
    /// `ERROR_MAX` of the target.
    #[must_use]
    pub fn beside(self, error: f64) -> Resolution {
        match self {
            Resolution::Target(target) if 0.0 < error && error < ERROR_MAX * target => {
                Resolution::Target((target * target - error * error).sqrt())
            }
            unchanged => unchanged,
        }
    }
}

/// The size of a mesh and the place at which it is refined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshPlan {
    /// Strips and cells.
    pub size: MeshSize,
    /// The point about which strips and cells gather, along the chords and across the patch, each from −1 to 1. `None` means equal strips and cosine-graded
    /// cells.
    pub pole: Option<[f64; 2]>,
}

impl From<MeshSize> for MeshPlan {
    fn from(size: MeshSize) -> Self {
        MeshPlan { size, pole: None }
    }
}

/// Rolling motion of the upper body relative to the lower one, divided by the rolling speed.
// The rigid slip at (x, y) is (ξ − φ y, η + φ x) (Kalker 1990, eq. 1.70). The spin is dimensionless where lengths are.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct Motion {
    /// Longitudinal creepage, dimensionless.
    #[schema(required = false)]
    pub creepage_x: f64,
    /// Lateral creepage, dimensionless.
    #[schema(required = false)]
    pub creepage_y: f64,
    /// Spin in 1/mm.
    #[schema(required = false)]
    pub spin_per_mm: f64,
}

impl Motion {
    /// The motion with the components ξ, η and φ.
    #[must_use]
    pub fn of([creepage_x, creepage_y, spin_per_mm]: [f64; 3]) -> Motion {
        Motion {
            creepage_x,
            creepage_y,
            spin_per_mm,
        }
    }

    /// The components ξ, η and φ.
    pub fn components(&self) -> [f64; 3] {
        [self.creepage_x, self.creepage_y, self.spin_per_mm]
    }

    /// Whether the bodies roll without creepage and spin.
    pub fn is_still(&self) -> bool {
        self.components() == [0.0; 3]
    }
}

/// Prescribed forces along x and across in N; `None` where the creepage is given instead.
pub type PrescribedForces = [Option<f64>; 2];
