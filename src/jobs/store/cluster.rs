//! What a store promises beside [`Store`](crate::jobs::store::Store) if several processes may use it at once.

use std::fmt::Debug;
use std::sync::Arc;

use async_trait::async_trait;
use object_store::ObjectStore;
use uuid::Uuid;

use crate::jobs::store_error::StoreError;

/// A hint to other processes that something happened. A process that misses one finds out by polling, a little later.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Notification {
    /// There is something to be claimed.
    Work,
    /// This job has ended.
    Ended(Uuid),
    /// This job is to be cancelled; its worker does so.
    Cancel(Uuid),
}

/// Where nodes receive each other's notifications. What is missed is found by polling, up to a second later.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum NotifyMode {
    /// At the URL of the database.
    #[default]
    Database,
    /// At another URL of the same database: a pooler that gives each transaction another session passes none on.
    Direct(String),
    /// Nowhere.
    Off,
}

/// A node as it shows itself to the others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Node {
    /// Random, new with every start.
    pub id: Uuid,
    /// Jobs that it solves at the same time.
    pub workers: usize,
}

/// What a node learns when it shows itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClusterView {
    /// Nodes that have shown themselves lately.
    pub nodes: usize,
    /// Their workers.
    pub workers: usize,
}

/// What a database knows of itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Deployment {
    /// Random, given when the tables were made.
    pub id: String,
    /// URL of the place of large results; empty: they are in the database; `None`: not decided.
    pub results_place: Option<String>,
    /// There are large results.
    pub has_results: bool,
    /// Nodes that have shown themselves lately.
    pub nodes: u64,
}

impl Deployment {
    /// The place of the results can no longer be changed.
    #[must_use]
    pub fn in_use(&self) -> bool {
        self.results_place.is_some() && (self.has_results || self.nodes > 0)
    }
}

/// Calls of a store that several processes use at once.
#[async_trait]
pub trait Cluster: Send + Sync + Debug {
    /// The clock of the store, epoch milliseconds.
    async fn now(&self) -> Result<i64, StoreError>;

    /// Shows that a node lives, and tells how many do.
    async fn beat(&self, node: &Node) -> Result<ClusterView, StoreError>;

    /// The node is no more.
    async fn leave(&self, node: Uuid) -> Result<(), StoreError>;

    /// Those of these running jobs that are to be cancelled.
    async fn cancel_requests(&self, running: &[Uuid]) -> Result<Vec<Uuid>, StoreError>;

    /// Shows that these batches are still received or filled. A batch of which nobody has shown that for a minute is
    /// [unfinished](crate::jobs::store::Batches::unfinished_batches).
    async fn keep_batches(&self, batches: &[Uuid]) -> Result<(), StoreError>;

    /// Removes large results that were written long ago and that no job refers to: what a node left that was killed between the
    /// two. Returns their number.
    async fn sweep_objects(&self) -> Result<u64, StoreError>;

    /// Brings what the database counts into a short form.
    async fn fold_counts(&self) -> Result<(), StoreError>;

    /// What the database knows of itself.
    async fn deployment(&self) -> Result<Deployment, StoreError>;

    /// Notes the place of the results if it is still what it was before; says whether it was.
    async fn place_results(&self, before: Option<&str>, place: &str) -> Result<bool, StoreError>;

    /// Takes the turn to sweep results outside the database, unless somebody did so within a day; says whether it has it.
    async fn take_sweep(&self) -> Result<bool, StoreError>;

    /// Where large results are kept that are in the database.
    fn objects(&self) -> Arc<dyn ObjectStore>;

    /// Rings soon, together with what else is to be rung. Never waits.
    fn publish(&self, notification: Notification);

    /// Listens to the notifications of all nodes until the connection fails; for ever with [`NotifyMode::Off`].
    async fn listen(&self, heard: &(dyn Fn(Notification) + Send + Sync)) -> Result<(), StoreError>;
}
