//! What the tangential problem of one footprint asks: physics, method and accuracy.
//!
//! How fine a solution is to be, and the size and grading of a mesh.
//!
//! The relative motion of two rolling bodies.

use railhead_macros::{Finite, Words};
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

/// Targets from here on are met with an operator in single precision. Chosen by judgement; how much it matters was not measured.
const SINGLE_PRECISION_FROM: f64 = 5e-4;

/// Residual to reach over the target error. Chosen by judgement; how much it matters was not measured.
const RESIDUAL_OF_TARGET: f64 = 0.04;
/// The same where forces are prescribed or differences are taken. The search finds the root of a force as a function of its creepage, and the residual is the noise of
/// that function: less than a tenth of what a force may be missed by (`SHARE_OF_TARGET`). Chosen by judgement.
const RESIDUAL_FOR_FORCES: f64 = 0.0015;
/// Largest residual that any target allows, relative to the traction scale. Chosen by judgement; how much it matters was not measured.
const TOLERANCE_LARGEST: f64 = 4e-4;

/// Residual of the friction law to which every method solves on a mesh of the client's, relative to the traction scale.
pub const TOLERANCE_LEAST: f64 = 1e-6;

/// The motions to be solved on one footprint, and how.
#[derive(Debug, Clone, Copy)]
pub struct RollingTask<'a> {
    /// Patches and pressures.
    pub footprint: &'a Footprint,
    /// Elastic constants of the pair.
    pub elasticity: &'a Elasticity,
    /// Bound of the tractions.
    pub friction: &'a FrictionLaw,
    /// What lies between the bodies.
    pub interface: Interface,
    /// The motions, in order; a creepage is 0 where a force is prescribed instead.
    pub motions: &'a [Motion],
    /// Forces prescribed instead of creepages, motion by motion.
    pub forces: &'a [PrescribedForces],
    /// Rolling speeds in mm/s, motion by motion, where they are known.
    pub speeds: &'a [Option<f64>],
    /// The number of the first of these motions in its case.
    pub first_motion: usize,
    /// The method.
    pub method: Method,
    /// Traction bound at which `fastsim` slips.
    pub traction_bound: TractionBound,
    /// Target or mesh.
    pub resolution: Resolution,
    /// Are slips asked for, or what follows from them? Forces do not depend on it.
    pub wants_slips: bool,
    /// Are differences of the resultants of near motions taken? They are solved to smaller residuals.
    pub is_differenced: bool,
}

impl RollingTask<'_> {
    /// The allowed error of the resultants, where an error is asked for rather than a mesh.
    pub fn target(&self) -> Option<f64> {
        self.resolution.target()
    }

    /// Residual to reach for motion `index`: far below the target, but no further, because iterating further does not improve the answer.
    pub fn tolerance(&self, index: usize) -> f64 {
        let is_prescribed =
            self.is_differenced || self.forces.get(index).is_some_and(|f| *f != [None; 2]);
        match self.resolution {
            Resolution::Target(target) => {
                let part = if is_prescribed {
                    RESIDUAL_FOR_FORCES
                } else {
                    RESIDUAL_OF_TARGET
                };
                (part * target).clamp(TOLERANCE_LEAST, TOLERANCE_LARGEST)
            }
            Resolution::Mesh(_) => TOLERANCE_LEAST,
        }
    }

    /// How the bounds of the cells fall with their slip in motion `index`, where they do; slips are counted in `slip_unit`.
    pub fn bound_fall(&self, index: usize, slip_unit: f64) -> Option<Softening> {
        let speed = self.speeds.get(index).copied().flatten();
        self.friction.bound_fall(speed, slip_unit)
    }

    /// What changes the bounds of motion `index` on the way through the contact, if anything does.
    pub fn passage(&self, index: usize) -> Option<PathDependentLaws<'_>> {
        let speed = self.speeds.get(index).copied().flatten();
        let laws = PathDependentLaws {
            heated: self.friction.heated().zip(speed),
            yielding: self.interface.yielding,
        };
        (laws.heated.is_some() || laws.yielding.is_some()).then_some(laws)
    }

    /// Why friction falls too fast with slip or temperature for an answer, if it does.
    pub fn falls_too_fast(&self) -> Option<String> {
        let modulus = self.interface.reduction * self.elasticity.shear_modulus;
        let patches = self.footprint.patches();
        self.friction.too_fast(patches, modulus, self.speeds)
    }

    /// Does the pressure make the surfaces slip, because the bodies differ and the method takes account of it?
    pub fn is_coupled(&self) -> bool {
        self.elasticity.difference != 0.0 && self.method == Method::BoundaryElement
    }

    /// Is a force prescribed for any motion?
    pub fn has_prescribed_forces(&self) -> bool {
        self.forces.iter().any(|forces| *forces != [None; 2])
    }

    /// Single precision serves any target that the residuals of single precision can meet.
    pub fn precision(&self) -> Precision {
        precision_of(self.resolution)
    }
}

/// See [`RollingTask::precision`].
pub fn precision_of(resolution: Resolution) -> Precision {
    match resolution {
        Resolution::Target(target) if target >= SINGLE_PRECISION_FROM => Precision::Single,
        _ => Precision::Double,
    }
}

/// Error of the resultants relative to μN that is allowed when nothing else is asked for, and that stands for an explicit mesh where a search needs a
/// target.
pub const TARGET_USUAL: f64 = 0.005;
/// An error below this part of the target is not worth another iteration.
pub(crate) const NEGLIGIBLE_OF_TARGET: f64 = 0.1;
/// Part of a target that another error may take up while the rest of it is still sought.
const ERROR_MAX: f64 = 0.95;

/// Least target of an error relative to μN: no mesh resolves less.
pub const TARGET_LEAST: f64 = 1e-4;

/// Reference quantity of a relative error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema, Words)]
#[serde(rename_all = "snake_case")]
pub enum RelativeTo {
    /// The friction limit μN.
    #[default]
    FrictionLimit,
    /// The tangential force of the motion, of all patches that share a frame.
    Force,
}

/// Mesh chosen by the solver for a target, or given by the client.
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

    /// The target, or what stands for it with an explicit mesh.
    pub fn target_or_usual(self) -> f64 {
        self.target().unwrap_or(TARGET_USUAL)
    }

    /// The target reduced so that its root sum of squares with another error equals the original; unchanged if that error is 0, or takes up
    /// the target so that the finest meshes would hardly meet the rest.
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

/// The size of a mesh and where it is graded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshPlan {
    /// Strips and cells.
    pub size: MeshSize,
    /// The point about which strips and cells gather, along the chords and across the patch, each from −1 to 1. Without one, strips are equal
    /// and cells are cosine-graded.
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
    /// The motion of ξ, η and φ.
    #[must_use]
    pub fn of([creepage_x, creepage_y, spin_per_mm]: [f64; 3]) -> Motion {
        Motion {
            creepage_x,
            creepage_y,
            spin_per_mm,
        }
    }

    /// ξ, η and φ.
    pub fn components(&self) -> [f64; 3] {
        [self.creepage_x, self.creepage_y, self.spin_per_mm]
    }

    /// Whether the bodies roll without creepage and spin.
    pub fn is_still(&self) -> bool {
        self.components() == [0.0; 3]
    }
}

/// The forces prescribed along x and across instead of creepages, in N, where they are.
pub type PrescribedForces = [Option<f64>; 2];
