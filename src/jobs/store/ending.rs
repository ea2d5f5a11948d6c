//! How attempts end: results and slices about to be stored, and stored.

use std::time::Duration;

use bytes::Bytes;
use uuid::Uuid;

use crate::contact::remark::entry::RemarkEntry;
use crate::jobs::codec::result::EncodedResult;
use crate::jobs::model::job::{Failure, State};

/// A solved slice about to be stored.
#[derive(Debug, Clone, PartialEq)]
pub struct NewSlice {
    /// What is known of it.
    pub note: SliceRecord,
    /// Its part of the answer.
    pub result: StoredResult,
    /// Part of the job that is done with it, 0 to 1.
    pub done: f64,
    /// Expected solve time of the rest in µs.
    pub rest_us: u64,
}

/// How an attempt ends.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    /// The result is stored.
    Succeeded {
        /// Remarks of the solution.
        remarks: Vec<RemarkEntry>,
        /// Where the result is kept.
        result: StoredResult,
        /// Patches with stored fields.
        field_patches: u32,
    },
    /// There is no answer.
    Failed(Failure),
    /// The client no longer wanted it.
    Cancelled,
    /// It gets the result of this succeeded job; the attempt does not count.
    Cached {
        /// Whose result it gets.
        source: Uuid,
    },
}

impl Ending {
    /// The state of the job that ended so.
    #[must_use]
    pub fn state(&self) -> State {
        match self {
            Ending::Succeeded { .. } | Ending::Cached { .. } => State::Succeeded,
            Ending::Failed(_) => State::Failed,
            Ending::Cancelled => State::Cancelled,
        }
    }
}

/// Where a result is kept once its job has ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StoredResult {
    /// Under this key, where it already lies, with its size in bytes.
    Blob(String, u64),
    /// In the database, written together with the end of the job: a small one.
    Inline(EncodedResult),
}

impl StoredResult {
    /// A small result as the database has it.
    pub(crate) fn inline(solution: Vec<u8>, fields: Option<Vec<u8>>) -> StoredResult {
        StoredResult::Inline(EncodedResult {
            solution: solution.into(),
            fields: fields.map(Bytes::from),
        })
    }

    /// Size in bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        match self {
            StoredResult::Blob(_, bytes) => *bytes,
            StoredResult::Inline(result) => result.bytes() as u64,
        }
    }
}

/// A result with what is needed to show it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ResultRef {
    /// Where it is, or itself.
    pub result: StoredResult,
    /// Patches with stored fields; 0 if there is no fields object.
    pub field_patches: usize,
    /// The outputs the case asks for, as the JSON list of their names.
    pub outputs: String,
}

/// What is known of a stored slice of a sweep.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SliceRecord {
    /// Place among the slices of the case, from 0.
    pub number: u32,
    /// Motions of the case up to its end.
    pub motions: u32,
    /// Digest of the case as the solver that solved it knew it; of another digest it is of no use.
    pub digest: String,
    /// Solver time of the job up to its end.
    pub spent: Duration,
}
