//! Results outside the job table, in a folder of the data folder or in an object store.
//!
//! Keys are `results/{yyyy}/{mm}/{job}/{lease token}/{name}`, with year and month of the job's submission (UTC). The lease
//! token in the key makes a late write of a worker that lost its lease harmless. Results are durable before their job
//! succeeds.
use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path as FilePath, PathBuf};
use std::sync::Arc;

use bytes::Bytes;
use futures_util::stream::{self, BoxStream};
use futures_util::{StreamExt, TryStreamExt};
use object_store::local::LocalFileSystem;
use object_store::path::Path;
use object_store::{GetOptions, ObjectStore, ObjectStoreExt, PutPayload};
use uuid::Uuid;

use crate::codec::fields::Header;
use crate::codec::result::EncodedResult;
use crate::error::{JobsError, Result};
use crate::store::Claim;
use crate::sync::blocking;
use railhead_contact::solution::words::answer::PatchFields;

/// The folder of the data folder that contains results.
pub(crate) const ROOT: &str = "results";

/// Bytes that the first request for a solution reads; larger solutions take three requests. Chosen by judgement: solutions
/// of single motions have some kilobytes, those of sweeps exceed this at a few hundred motions.
const READ_AT_ONCE: u64 = 256 << 10;

/// Bytes that the first request for fields reads: usually the whole header. Chosen by judgement; a longer header takes
/// another request.
const FIELDS_AT_ONCE: u64 = 16 << 10;

const SOLUTION: &str = "solution.json";

const FIELDS: &str = "fields.bin";

/// Name of the answers of a chunk of rows, which other programs read too.
const ROWS: &str = "rows.parquet";

/// Store of results.
#[derive(Debug, Clone)]
pub struct Blobs {
    pub(crate) objects: Arc<dyn ObjectStore>,
    /// The local folder, if it is one.
    root: Option<PathBuf>,
}

/// Number of results that were copied to another store.
#[cfg(feature = "cluster")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Copied {
    /// Number of copied results.
    pub results: u64,
    /// Total size of these results in bytes.
    pub bytes: u64,
    /// Number of missing results, whose jobs stay without a result.
    pub missing: u64,
}

#[cfg(feature = "cluster")]
impl Copied {
    /// Adds the outcome of [`Blobs::copy`].
    pub(crate) fn add(&mut self, copied: Option<u64>) {
        match copied {
            Some(bytes) => {
                self.results += 1;
                self.bytes += bytes;
            }
            None => self.missing += 1,
        }
    }
}

impl Blobs {
    /// Opens the store below the folder `root`, which is created if it does not exist.
    ///
    /// # Errors
    /// The folder cannot be created or read.
    pub fn open(root: &FilePath) -> Result<Blobs> {
        std::fs::create_dir_all(root).map_err(JobsError::at(root))?;
        let objects = LocalFileSystem::new_with_prefix(root)?.with_fsync(true);
        Ok(Blobs {
            objects: Arc::new(objects),
            root: Some(root.to_owned()),
        })
    }

    /// A store of results in an object store; `root` is its folder if it is local.
    #[must_use]
    pub fn at(objects: Arc<dyn ObjectStore>, root: Option<PathBuf>) -> Blobs {
        Blobs { objects, root }
    }

    /// Stores a result and returns its key; durable once it returns. For a slice of a sweep, `{lease token}-{number of the
    /// slice}` replaces the lease token.
    ///
    /// # Errors
    /// The write failed.
    pub async fn put(
        &self,
        claim: &Claim,
        slice: Option<u32>,
        result: EncodedResult,
    ) -> Result<String> {
        let slice = slice.map_or_else(String::new, |number| format!("-{number}"));
        let folder = job_folder(claim.id).join(format!("{}{slice}", claim.lease_token));
        let name = if result.is_rows() { ROWS } else { FIELDS };
        if let Some(fields) = result.fields {
            self.objects
                .put(&folder.clone().join(name), PutPayload::from_bytes(fields))
                .await?;
        }
        self.objects
            .put(
                &folder.clone().join(SOLUTION),
                PutPayload::from_bytes(result.solution),
            )
            .await?;
        self.make_private(&folder).await?;
        Ok(folder.to_string())
    }

    /// Reads a solution as JSON text.
    ///
    /// # Errors
    /// The read failed.
    pub async fn solution(&self, folder: &str) -> Result<Bytes> {
        let path = Path::from(folder).join(SOLUTION);
        Ok(self.objects.get(&path).await?.bytes().await?)
    }

    /// Reads the answers of a chunk of rows.
    ///
    /// # Errors
    /// The read failed.
    pub async fn chunk_answers(&self, folder: &str) -> Result<Bytes> {
        let path = Path::from(folder).join(ROWS);
        Ok(self.objects.get(&path).await?.bytes().await?)
    }

    /// Opens a solution: its size, and a stream of its text without the closing brace.
    ///
    /// # Errors
    /// The read failed, or the solution is no object.
    pub async fn open_solution(
        &self,
        folder: &str,
    ) -> Result<(usize, BoxStream<'static, Result<Bytes>>)> {
        let path = Path::from(folder).join(SOLUTION);
        // One request reads a small solution, and the size of a large one.
        let first = GetOptions {
            range: Some((0..READ_AT_ONCE).into()),
            ..GetOptions::default()
        };
        let found = self.objects.get_opts(&path, first).await?;
        let size = found.meta.size;
        let open = size.saturating_sub(1);
        let damaged = || JobsError::Damaged(format!("{path} is no object"));
        let bytes = usize::try_from(size).unwrap_or(usize::MAX);
        if size <= READ_AT_ONCE {
            let text = found.bytes().await?;
            if !text.ends_with(b"}") || open == 0 {
                return Err(damaged());
            }
            let open = text.slice(..text.len() - 1);
            return Ok((bytes, stream::iter([Ok(open)]).boxed()));
        }
        let last = self.objects.get_range(&path, open..size).await?;
        if &*last != b"}" {
            return Err(damaged());
        }
        let whole = GetOptions {
            range: Some((0..open).into()),
            ..GetOptions::default()
        };
        let pieces = self.objects.get_opts(&path, whole).await?.into_stream();
        Ok((bytes, pieces.map_err(JobsError::from).boxed()))
    }

    /// Reads a whole result.
    ///
    /// # Errors
    /// The read failed.
    pub async fn whole(&self, folder: &str) -> Result<EncodedResult> {
        let solution = self.solution(folder).await?;
        let path = Path::from(folder).join(FIELDS);
        let fields = match self.objects.get(&path).await {
            Ok(found) => Some(found.bytes().await?),
            Err(object_store::Error::NotFound { .. }) => None,
            Err(error) => return Err(error.into()),
        };
        Ok(EncodedResult { solution, fields })
    }

    /// Reads the cells of one patch, with the values of one motion or of all motions.
    ///
    /// # Errors
    /// There is no such motion, or the fields cannot be read.
    pub async fn patch_fields(
        &self,
        folder: &str,
        patch: usize,
        point: Option<usize>,
    ) -> Result<PatchFields> {
        let path = Path::from(folder).join(FIELDS);
        let damaged = |error: String| JobsError::Damaged(format!("{path}: {error}"));
        let start = self.objects.get_range(&path, 0..FIELDS_AT_ONCE).await?;
        let header = match Header::read(&start).map_err(damaged)? {
            Ok(header) => header,
            Err(end) => {
                let whole = self.objects.get_range(&path, 0..end).await?;
                let read = Header::read(&whole).map_err(damaged)?;
                read.map_err(|_| damaged("cut short".to_owned()))?
            }
        };
        let ranges = header.ranges(patch, point)?;
        let pieces = self.objects.get_ranges(&path, &ranges).await?;
        // Decompression takes CPU time, so it runs outside the request threads.
        let decoded = blocking(move || header.decode(patch, point, &pieces.concat()));
        decoded.await?.map_err(damaged)
    }

    /// Writes and removes an object of this size.
    ///
    /// # Errors
    /// The write failed.
    pub(crate) async fn try_write(&self, bytes: usize) -> Result<()> {
        let path = Path::from(ROOT).join(format!("probe-{}", Uuid::now_v7()));
        let written = self.objects.put(&path, vec![0; bytes].into()).await;
        written?;
        Ok(self.objects.delete(&path).await?)
    }

    /// Copies the result with this key to another store; returns its size in bytes, or `None` if it does not exist.
    ///
    /// # Errors
    /// A read or write failed.
    pub async fn copy(&self, key: &str, to: &Blobs) -> Result<Option<u64>> {
        let folder = Path::from(key);
        let mut bytes = 0;
        // The solution last, as in `put`.
        for name in [FIELDS, ROWS, SOLUTION] {
            let path = folder.clone().join(name);
            let body = match self.objects.get(&path).await {
                Ok(found) => found.bytes().await?,
                Err(object_store::Error::NotFound { .. }) if name == SOLUTION => return Ok(None),
                Err(object_store::Error::NotFound { .. }) => continue,
                Err(error) => return Err(error.into()),
            };
            bytes += body.len() as u64;
            to.objects.put(&path, PutPayload::from_bytes(body)).await?;
        }
        to.make_private(&folder).await?;
        Ok(Some(bytes))
    }

    /// Removes the result with this key; no error if it does not exist.
    ///
    /// # Errors
    /// The removal failed.
    pub async fn remove(&self, key: &str) -> Result<()> {
        let folder = Path::from(key);
        for name in [SOLUTION, FIELDS, ROWS] {
            match self.objects.delete(&folder.clone().join(name)).await {
                Ok(()) | Err(object_store::Error::NotFound { .. }) => {}
                Err(error) => return Err(error.into()),
            }
        }
        self.scrub(&folder).await
    }

    /// Removes a local folder with partial files of a killed process, which the object store does not list, and the folder
    /// of the job if it is empty.
    async fn scrub(&self, folder: &Path) -> Result<()> {
        let Some(root) = &self.root else {
            return Ok(());
        };
        let path = root.join(folder.as_ref());
        match tokio::fs::remove_dir_all(&path).await {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                return Err(JobsError::at(&path)(source));
            }
            _ => {}
        }
        if let Some(job) = path.parent() {
            // Fails while it contains another attempt.
            let _ = tokio::fs::remove_dir(job).await;
        }
        Ok(())
    }

    /// Restricts access to new local files to the owner.
    async fn make_private(&self, folder: &Path) -> Result<()> {
        let Some(root) = &self.root else {
            return Ok(());
        };
        let path = root.join(folder.as_ref());
        for name in [SOLUTION, FIELDS, ROWS] {
            let mode = Permissions::from_mode(0o600);
            match tokio::fs::set_permissions(path.join(name), mode).await {
                Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                    return Err(JobsError::at(&path)(source));
                }
                _ => {}
            }
        }
        Ok(())
    }
}

/// The folder of the results of a job.
fn job_folder(id: Uuid) -> Path {
    let seconds = id.get_timestamp().map_or(0, |time| time.to_unix().0);
    let time = i64::try_from(seconds)
        .ok()
        .and_then(|s| jiff::Timestamp::from_second(s).ok());
    let date = time
        .unwrap_or_default()
        .to_zoned(jiff::tz::TimeZone::UTC)
        .date();
    Path::from(format!(
        "{ROOT}/{:04}/{:02}/{id}",
        date.year(),
        date.month()
    ))
}

impl Blobs {
    /// Lists all results in the order of their keys: job, key, and time of the write in epoch milliseconds.
    pub fn listed(&self) -> BoxStream<'static, Result<(Uuid, String, i64)>> {
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

    /// The keys of all results of a month, by job.
    ///
    /// # Errors
    /// Listing failed.
    pub async fn keys(&self, month: &Path) -> Result<Vec<(Uuid, String)>> {
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

    /// The months that have results.
    ///
    /// # Errors
    /// Listing failed.
    pub async fn months(&self) -> Result<Vec<Path>> {
        let mut months = Vec::new();
        for year in self.below(&Path::from(ROOT)).await? {
            months.extend(self.below(&year).await?);
        }
        Ok(months)
    }

    async fn below(&self, folder: &Path) -> Result<Vec<Path>> {
        let listed = self.objects.list_with_delimiter(Some(folder)).await?;
        Ok(listed.common_prefixes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claim(id: Uuid, lease_token: u64) -> Claim {
        Claim {
            id,
            attempt: 1,
            lease_token,
            method: "auto".to_owned(),
            traceparent: None,
            cache_key: None,
            suspect: false,
            slices: 0,
        }
    }

    fn encoded(text: &'static str) -> EncodedResult {
        EncodedResult {
            solution: Bytes::from_static(text.as_bytes()),
            fields: Some(Bytes::from_static(b"fields")),
        }
    }

    #[test]
    fn a_job_lies_in_the_month_of_its_submission() {
        // 2024-02-29T23:59:59.999Z in milliseconds, the leading 48 bits of a UUIDv7.
        let id = Uuid::from_u128((1_709_251_199_999_u128 << 80) | (7 << 76) | (2 << 62) | 1);
        assert_eq!(job_folder(id).to_string(), format!("results/2024/02/{id}"));
    }

    #[tokio::test]
    async fn attempts_are_kept_apart_and_removed_one_by_one() {
        let folder = tempfile::tempdir().unwrap();
        let results = Blobs::open(folder.path()).unwrap();
        let id = Uuid::now_v7();
        let first = results
            .put(&claim(id, 1), None, encoded("1"))
            .await
            .unwrap();
        let second = results
            .put(&claim(id, 2), None, encoded("2"))
            .await
            .unwrap();
        assert_ne!(first, second);
        // A process that is killed in the middle of a write leaves such a file.
        std::fs::write(folder.path().join(&first).join("fields.bin#1"), b"half").unwrap();

        results.remove(&first).await.unwrap();
        assert!(!folder.path().join(&first).exists());
        assert!(folder.path().join(&second).join(SOLUTION).exists());
        let months = results.months().await.unwrap();
        let keys = results.keys(&months[0]).await.unwrap();
        assert_eq!((months.len(), keys), (1, vec![(id, second.clone())]));

        results.remove(&second).await.unwrap();
        assert_eq!(results.keys(&months[0]).await.unwrap(), []);
        results.remove(&second).await.unwrap();
    }

    #[tokio::test]
    async fn what_is_stored_is_for_nobody_else_to_read() {
        let folder = tempfile::tempdir().unwrap();
        let results = Blobs::open(folder.path()).unwrap();
        let claim = claim(Uuid::now_v7(), 1);
        let key = results.put(&claim, None, encoded("1")).await.unwrap();
        let key = folder.path().join(key);
        for name in [SOLUTION, FIELDS] {
            let about = std::fs::metadata(key.join(name)).unwrap();
            assert_eq!(about.permissions().mode() & 0o777, 0o600, "{name}");
        }
    }
}
