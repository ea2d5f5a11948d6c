//! A wheel at rest on its rail.

use crate::contact::geometry::reference_curve::{CurvePlace, WheelOver};
use crate::contact::normal::patch::Patch;
use crate::contact::normal::pressure_field::field::PressureField;
use crate::contact::remark::entry::RemarkEntry;

/// The wheel at rest on its rail.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelContact {
    /// How far the wheel is below first touch, in mm.
    pub lowering: f64,
    /// Height of the wheel's centre over the top of the rail, in mm.
    pub centre: f64,
    /// The patches, from smaller to larger y of the track; never empty.
    pub patches: Vec<WheelPatch>,
    /// Remarks for the answer.
    pub remarks: Vec<RemarkEntry>,
}

/// A patch between a wheel and a rail.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelPatch {
    /// x of the load centre in mm.
    pub x: f64,
    /// The place of the load centre on the rail.
    pub place: CurvePlace,
    /// The undeformed wheel over the load centre.
    pub wheel: WheelOver,
    /// Parameters of rail and wheel at the ends across.
    pub ends: [[f64; 2]; 2],
    /// Region and pressure from the load centre, of this patch and of those that are solved together with it.
    pub field: PressureField,
    /// Number of the patch in the field.
    pub number: usize,
}

impl WheelPatch {
    /// Its region and forces.
    #[must_use]
    pub fn patch(&self) -> Patch {
        self.field.patches()[self.number]
    }

    /// The normal force in N.
    #[must_use]
    pub fn normal_force(&self) -> f64 {
        self.patch().normal_force
    }
}

impl WheelContact {
    /// Sum of the normal forces in N.
    #[must_use]
    pub fn normal_force(&self) -> f64 {
        self.patches.iter().map(WheelPatch::normal_force).sum()
    }
}
