//! Batches that are not acknowledged: being received and filled, or given up and to be removed.

use std::collections::HashSet;

use uuid::Uuid;

/// Batches that are not acknowledged.
#[derive(Debug, Default)]
pub(crate) struct UnfinishedBatches {
    /// Being received or filled by this process.
    pub(crate) living: HashSet<Uuid>,
    /// Given up: their jobs are neither solved nor shown, and are removed as soon as the disk allows it.
    pub(crate) abandoned: HashSet<Uuid>,
}

impl UnfinishedBatches {
    /// This process neither receives nor fills this batch any more.
    pub(crate) fn forget(&mut self, id: Uuid) {
        self.living.remove(&id);
    }
}
