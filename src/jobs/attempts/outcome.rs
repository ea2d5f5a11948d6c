//! What a solver thread is given and what comes back.

use crate::contact::error::{CaseError, SolveError};
use crate::contact::remark::entry::RemarkEntry;
use crate::jobs::attempts::slices::SlicedWork;
use crate::jobs::codec::result::EncodedResult;
use crate::jobs::model::job::{Failure, FailureKind};
use crate::jobs::store::ending::SliceRecord;
use crate::jobs::store::submission::StoredCase;

/// What came out of the solver thread.
#[derive(Debug)]
pub(crate) enum Outcome {
    /// The answer in its stored form.
    Solved {
        result: EncodedResult,
        remarks: Vec<RemarkEntry>,
        field_patches: u32,
    },
    /// The next slice of a sweep, in its stored form, if one was solved; there is more to be done.
    Slice {
        sliced: Box<SlicedWork>,
        part: Option<(SliceRecord, EncodedResult)>,
    },
    /// The solver gave up or was stopped.
    Unsolved(SolveError),
    /// The case no longer passes its checks.
    Refused(CaseError),
    /// The fault is ours.
    Broken(Failure),
    /// The solver did not listen and was left behind.
    Abandoned,
}

impl Outcome {
    /// The outcome of work that a defect of the service ended. The log has the reason.
    pub(crate) fn internal(reason: &str) -> Outcome {
        tracing::error!(reason, "a job fails inside the service");
        Outcome::Broken(Failure::new(FailureKind::Internal, INTERNAL))
    }
}

/// The outcome of work. An outcome that ends the work early is the `Err`, so that `?` returns it.
pub(crate) type Ended = Result<Outcome, Box<Outcome>>;

impl From<SolveError> for Box<Outcome> {
    fn from(error: SolveError) -> Box<Outcome> {
        Box::new(Outcome::Unsolved(error))
    }
}

impl From<CaseError> for Box<Outcome> {
    fn from(error: CaseError) -> Box<Outcome> {
        Box::new(Outcome::Refused(error))
    }
}

/// The reason of an internal error.
impl From<String> for Box<Outcome> {
    fn from(reason: String) -> Box<Outcome> {
        Box::new(Outcome::internal(&reason))
    }
}

/// What is to be done for a job.
#[derive(Debug)]
pub(crate) enum Work {
    /// Check the case, of which this is stored, and solve what comes next.
    New(StoredCase, Vec<SliceRecord>),
    /// Solve the next slice.
    Next(Box<SlicedWork>),
    /// All slices are solved: put the parts of the answer together.
    Join(Box<SlicedWork>, Vec<EncodedResult>),
}

/// What clients read of a failure of the service itself.
pub(crate) const INTERNAL: &str = "the job could not be solved because of a fault of the service; its log has the reason under the id of the job";
