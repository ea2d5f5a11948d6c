//! The table of creep forces as a second answer, against which the resultants of a mesh are held. It tells their error without another
//! mesh, where it covers the patch and its own bound leaves room below the target.

use crate::contact::friction::law::FrictionLaw;
use crate::contact::method::Method;
use crate::contact::rolling::load_ellipse::LoadEllipse;
use crate::contact::rolling::methods::table::solve as table;
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::refinement::distances::distances;
use crate::contact::rolling::resultants::Resultants;
use crate::contact::rolling::task::RollingTask;

/// The estimate is the distance to the table plus this part of the table's bound. On the first 200 ellipses of `cargo bench --bench calibrate
/// ellipse` at the targets .02, .005 and .001 it covers .99, 1.0 and .975, on the other 200 .985, .97 and .98; 0.3 covers .96 at .02. 0.5 covers
/// as many of these, but .93 of the motions of curves and maps in one half.
const BOUND_SHARE: f64 = 0.6;
/// What the table, of like bodies, is off by where they differ, over |K|/μ: by up to 1.43 on ellipses of a/b ½ to 2 with |K| from 0.02 to 0.3, μ from
/// 0.1 to 0.6 and six motions; some of them are a test (`cargo test --test physics table_check`).
const UNLIKE: f64 = 1.5;

/// The table of one patch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CoveredPatch {
    ellipse: LoadEllipse,
    shear_modulus: f64,
    poisson_ratio: f64,
    /// μN in N.
    limit: f64,
    /// Error because the bodies differ, relative to μN.
    unlike: f64,
}

impl CoveredPatch {
    /// The patch of a task, if the table covers what is asked.
    #[must_use]
    pub(crate) fn of(task: &RollingTask) -> Option<CoveredPatch> {
        let FrictionLaw::Constant(_) = task.friction else {
            return None;
        };
        let covered = task.compares_with_table
            && task.method == Method::BoundaryElement
            && task.footprint.ellipse().is_some()
            && task.interface.layer == 0.0;
        let ellipse = covered.then(|| LoadEllipse::of(task.footprint, 0))?;
        let limit = task.friction.limit(task.footprint, 0);
        let inside = table::outside(ellipse.ratio()).is_none() && limit > 0.0;
        inside.then_some(CoveredPatch {
            ellipse,
            shear_modulus: task.interface.reduction * task.elasticity.shear_modulus,
            poisson_ratio: task.elasticity.poisson_ratio,
            limit,
            unlike: UNLIKE * task.elasticity.difference.abs() / task.friction.largest(),
        })
    }

    /// What the table says of a motion.
    #[must_use]
    pub(crate) fn answer(&self, motion: &Motion) -> TableCheck {
        let (resultants, bound) = table::resultants(
            self.shear_modulus,
            self.poisson_ratio,
            &self.ellipse,
            self.limit,
            motion,
        );
        TableCheck {
            resultants,
            off: BOUND_SHARE * bound + self.unlike,
        }
    }
}

/// What the table says of a motion of a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableCheck {
    resultants: Resultants,
    /// By how much they may be off, relative to μN (moment: μN√(A/π)).
    off: f64,
}

impl TableCheck {
    /// The error of resultants found on a mesh, relative to μN (moment: μN√(A/π)).
    #[must_use]
    pub(crate) fn error(&self, task: &RollingTask, found: &[Resultants]) -> f64 {
        let apart = distances(task, task.footprint.patches(), found, &[self.resultants]);
        apart.into_iter().fold(0.0, f64::max) + self.off
    }

    /// An `error` found by [`TableCheck::error`], if the distance were a multiple of what it is.
    #[must_use]
    pub(crate) fn with_distance_times(&self, multiple: f64, error: f64) -> f64 {
        multiple * (error - self.off) + self.off
    }
}
