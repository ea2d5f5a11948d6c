//! Kinds of work, and the queues in which it waits.

use std::sync::Arc;

/// A kind of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Kind {
    /// One case: a job.
    Case,
    /// Many cases: a batch, each case of which is a job.
    Cases,
    /// Many rows over one case: a run, which is solved in chunks of rows.
    Rows,
}

impl Kind {
    /// The name under which the kind is stored.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Kind::Case => "case",
            Kind::Cases => "cases",
            Kind::Rows => "rows",
        }
    }

    /// What clients call work of this kind.
    #[must_use]
    pub fn noun(self) -> &'static str {
        match self {
            Kind::Case => "job",
            Kind::Cases => "batch",
            Kind::Rows => "run",
        }
    }

    /// The kind with this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Kind> {
        let mut all = [Kind::Case, Kind::Cases, Kind::Rows].into_iter();
        all.find(|kind| kind.name() == name)
    }

    /// The kind of a single job of this work.
    #[must_use]
    pub fn of_job(self) -> Kind {
        match self {
            Kind::Case | Kind::Cases => Kind::Case,
            Kind::Rows => Kind::Rows,
        }
    }
}

/// A queue of jobs. The jobs of a tenant and the chunks of its runs wait in one each, so that neither holds up the other.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Queue {
    /// The tenant.
    pub tenant: Arc<str>,
    /// [`Kind::Case`] or [`Kind::Rows`].
    pub kind: Kind,
}
