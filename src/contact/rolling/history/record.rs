//! What is kept of a point of a history.

use crate::contact::rolling::answer::Work;
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::resultants::Resultants;

/// A solved point of a history on one level.
#[derive(Debug, Clone, Default)]
pub struct PointRecord {
    /// Creepages and spin, in the units of the case; found where forces are prescribed.
    pub motion: Motion,
    /// The shift that led here without rolling, in mm and rad.
    pub shift: Motion,
    /// Resultants of every patch about the origin of the case.
    pub resultants: Vec<Resultants>,
    /// Power of friction of every patch over the rolling speed, in N; 0 of a shift.
    pub power: Vec<f64>,
    /// What friction has dissipated since the start, of every patch, in N·mm.
    pub dissipated: Vec<f64>,
    /// Sum of the lengths of all tractions over the friction limit.
    pub carried: f64,
    /// Elastic energy of all tangential displacements in N·mm.
    pub elastic: f64,
    /// Tractions, slips, and which cells slip, dimensionless on the level.
    pub traction: [Vec<f64>; 2],
    /// See [`PointRecord::traction`].
    pub slip: [Vec<f64>; 2],
    /// See [`PointRecord::traction`].
    pub slips: Vec<bool>,
    /// A prescribed force could not be reached.
    pub saturated: bool,
    /// Work since the point before.
    pub work: Work,
}
