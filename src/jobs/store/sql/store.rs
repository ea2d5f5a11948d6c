//! The job table as a whole.

use super::engine::{self, SqlStore};
use async_trait::async_trait;

use crate::jobs::store::Store;
use crate::jobs::store::cluster::Cluster;
use crate::jobs::store_error::StoreError;

#[async_trait]
impl Store for SqlStore {
    async fn ready(&self, write: bool) -> Result<(), StoreError> {
        engine::again(|| self.ready(write)).await
    }

    fn cluster(&self) -> Option<&dyn Cluster> {
        self.as_cluster()
    }

    async fn close(&self) {
        self.close().await;
    }

    async fn compact(&self, spare: i64, step: u32) -> Result<bool, StoreError> {
        engine::again(|| self.compact(spare, step)).await
    }
}
