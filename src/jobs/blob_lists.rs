//! What results there are: lists of the keys under which they are stored.

use futures_util::stream::BoxStream;
use futures_util::{StreamExt, TryStreamExt};
use object_store::ObjectStore;
use object_store::path::Path;
use uuid::Uuid;

use crate::jobs::blobs::{Blobs, ROOT};
use crate::jobs::error::JobsError;

impl Blobs {
    /// Everything that is stored, in the order of the keys: the job, the key, and when it was written, in epoch milliseconds.
    pub fn listed(&self) -> BoxStream<'static, Result<(Uuid, String, i64), JobsError>> {
        let listed = self.objects.list(Some(&Path::from(ROOT)));
        let read = listed
            .map_err(JobsError::from)
            .try_filter_map(async |object| {
                let written = object.last_modified.timestamp_millis();
                let path = object.location.as_ref();
                let key = path.rsplit_once('/').map(|(key, _)| key);
                let job = key.and_then(|key| Uuid::try_parse(key.rsplit('/').nth(1)?).ok());
                Ok(job
                    .zip(key)
                    .map(|(job, key)| (job, key.to_owned(), written)))
            });
        read.boxed()
    }

    /// The keys of everything that is stored, job by job, month by month.
    ///
    /// # Errors
    /// The store cannot be listed.
    pub async fn keys(&self, month: &Path) -> Result<Vec<(Uuid, String)>, JobsError> {
        let mut keys = Vec::new();
        for job in self.below(month).await? {
            let Some(id) = job.filename().and_then(|id| Uuid::try_parse(id).ok()) else {
                continue;
            };
            let attempts = self.below(&job).await?;
            keys.extend(attempts.into_iter().map(|key| (id, key.to_string())));
        }
        Ok(keys)
    }

    /// The months in which something is stored.
    ///
    /// # Errors
    /// The store cannot be listed.
    pub async fn months(&self) -> Result<Vec<Path>, JobsError> {
        let mut months = Vec::new();
        for year in self.below(&Path::from(ROOT)).await? {
            months.extend(self.below(&year).await?);
        }
        Ok(months)
    }

    async fn below(&self, folder: &Path) -> Result<Vec<Path>, JobsError> {
        let listed = self.objects.list_with_delimiter(Some(folder)).await?;
        Ok(listed.common_prefixes)
    }
}
