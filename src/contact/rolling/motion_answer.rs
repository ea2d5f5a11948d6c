//! The tangential answer for one motion: resultants, and the fields they come from where the method has any.

use crate::contact::method::Method;
use crate::contact::remark::list::Remark;
use crate::contact::rolling::answer::Skip;
use crate::contact::rolling::answer::{LevelAnswer, Work};
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::resultants::Resultants;

/// Relative errors of every patch, then of the sum over them; nothing where there is nothing to compare with.
pub type RelativeErrors = Vec<Option<f64>>;

/// The answer for one motion.
#[derive(Debug, Clone)]
pub struct MotionAnswer {
    /// The motion it was solved for.
    pub motion: Motion,
    /// A prescribed force could not be reached.
    pub saturated: bool,
    /// Resultants of every patch about the origin of the case: the best known.
    pub resultants: Vec<Resultants>,
    /// Their estimated errors relative to μN: one per patch, then that of the sum.
    pub errors: RelativeErrors,
    /// Tractions, slips and zones; none from a method that knows resultants only ([`Method::has_fields`]).
    pub fields: Option<SolvedFields>,
    /// Share of every patch that sticks, from methods without fields that know it.
    pub stick: Option<Vec<f64>>,
    /// Derivatives of the resultants of every patch, where they were asked for or come with the method.
    pub gradients: Option<Vec<PatchGradients>>,
    /// What a history adds to a motion; nothing of steady rolling.
    pub history: Option<HistoryAnswer>,
    /// Work that was not needed.
    pub skips: Vec<Skip>,
    /// Remarks for the client.
    pub remarks: Vec<Remark>,
    /// Work over all levels.
    pub work: Work,
    /// The method that gave the resultants.
    pub method: Method,
    /// Wall time in s.
    pub seconds: f64,
}

/// What is known of a point of a history beside its forces.
#[derive(Debug, Clone, PartialEq)]
pub struct HistoryAnswer {
    /// Distance rolled since the start in mm.
    pub distance: f64,
    /// Displacement of the upper body against the lower one from the point before in mm and rad, where the bodies did not roll.
    pub shift: Option<Motion>,
    /// Power of friction over the rolling speed of every patch, in N; 0 of a shift.
    pub power: Vec<f64>,
    /// What friction has dissipated since the start in every patch, in N·mm.
    pub dissipated: Vec<f64>,
    /// Estimated errors of the creepages that were found.
    pub creepage_errors: [Option<f64>; 2],
    /// The same of shifts, in mm.
    pub shift_errors: [Option<f64>; 2],
}

/// Derivatives of F_x, F_y and M_z about the origin of the case by ν_x, ν_y and φ (per mm): `[resultant][creepage]` in N and mm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PatchGradients {
    /// The derivatives.
    pub values: [[f64; 3]; 3],
    /// Their estimated absolute errors, where they are known.
    pub errors: Option<[[f64; 3]; 3]>,
}

/// The fields of a motion on the finest level it needed.
#[derive(Debug, Clone)]
pub struct SolvedFields {
    /// The number of that level in the levels.
    pub level: usize,
    /// Tractions, slips and zones on it.
    pub tangential: LevelAnswer,
}

impl MotionAnswer {
    /// Replaces the resultants, and what belongs to them, by those of another method; the values per cell stay.
    pub(crate) fn take_resultants(&mut self, of: &MotionAnswer) {
        self.resultants.clone_from(&of.resultants);
        self.errors.clone_from(&of.errors);
        self.stick.clone_from(&of.stick);
        self.gradients.clone_from(&of.gradients);
        self.method = of.method;
    }

    /// Tangential force of all patches over their friction limit in N; 0 without friction.
    #[must_use]
    pub fn force_share(&self, limit: f64) -> f64 {
        let sum = Resultants::default();
        let sum = self.resultants.iter().fold(sum, |sum, r| sum.plus(*r));
        let force = sum.force_x.hypot(sum.force_y);
        if limit > 0.0 { force / limit } else { 0.0 }
    }

    /// Estimated error of the sum over the patches.
    #[must_use]
    pub fn error(&self) -> Option<f64> {
        self.errors.last().copied().flatten()
    }
}
