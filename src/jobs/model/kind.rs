//! Kinds of work, and the queues in which it waits.

use std::sync::Arc;

/// A kind of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub enum Kind {
    /// One case: a job.
    #[default]
    Case,
    /// Many cases: a batch, each case of which is a job.
    Cases,
    /// Many rows over one case: a run, which is solved in chunks of rows.
    Rows,
    /// Profiles that wear step by step: one job, whose slices are steps.
    Evolution,
}

names! {
    pub Kind {
        Case = "case",
        Cases = "cases",
        Rows = "rows",
        Evolution = "evolution",
    }
}

impl Kind {
    /// What clients call work of this kind.
    #[must_use]
    pub fn noun(self) -> &'static str {
        match self {
            Kind::Case => "job",
            Kind::Cases => "batch",
            Kind::Rows => "run",
            Kind::Evolution => "evolution",
        }
    }

    /// The same in the plural, also the name of the resource.
    #[must_use]
    pub fn nouns(self) -> &'static str {
        match self {
            Kind::Case => "jobs",
            Kind::Cases => "batches",
            Kind::Rows => "runs",
            Kind::Evolution => "evolutions",
        }
    }

    /// The kind of a single job of this work.
    #[must_use]
    pub fn of_job(self) -> Kind {
        match self {
            Kind::Case | Kind::Cases => Kind::Case,
            Kind::Rows => Kind::Rows,
            Kind::Evolution => Kind::Evolution,
        }
    }
}

/// A queue of jobs. The jobs of a tenant, the chunks of its runs and its evolutions wait in one each, so that none holds up the others.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Queue {
    /// The tenant.
    pub tenant: Arc<str>,
    /// [`Kind::Case`], [`Kind::Rows`] or [`Kind::Evolution`].
    pub kind: Kind,
}
