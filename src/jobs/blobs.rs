//! Stored results: blobs outside the job table, in a folder of the data folder or in the object store that comes with a
//! database.
//!
//! Keys are `results/{yyyy}/{mm}/{job}/{lease token}/{name}`, year and month those of the job's submission (UTC). The
//! lease token in the key makes a late write of a worker that lost its lease harmless. Blobs are written, and
//! synced to the disk, before the job is called succeeded.
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

use crate::codec::fields::{Header, PREFIX_BYTES, header_length};
use crate::codec::result::EncodedResult;
use crate::error::{JobsError, Result};
use crate::store::Claim;
use crate::sync::blocking;
use railhead_contact::solution::words::answer::PatchFields;

/// The folder of the data folder in which results lie.
pub(crate) const ROOT: &str = "results";

/// Bytes that one request reads of a solution whose size is not known; larger ones take three. Chosen by judgement: solutions of single
/// motions have some kilobytes, those of sweeps pass this at a few hundred motions.
const READ_AT_ONCE: u64 = 256 << 10;

/// Bytes that the first request reads of fields: their header, which is rarely longer. Chosen by judgement; a longer one takes another
/// request.
const FIELDS_AT_ONCE: u64 = 16 << 10;

const SOLUTION: &str = "solution.json";

const FIELDS: &str = "fields.bin";

/// The answers of a chunk of rows, in place of fields: other programs know the file by its name.
const ROWS: &str = "rows.parquet";

/// The place where results are kept.
#[derive(Debug, Clone)]
pub struct Blobs {
    pub(crate) objects: Arc<dyn ObjectStore>,
    /// The folder, if it is one.
    root: Option<PathBuf>,
}

impl Blobs {
    /// Keeps results below `root`, which is created if it is not there.
    ///
    /// # Errors
    /// The folder cannot be created or read.
    pub fn open(root: &FilePath) -> Result<Blobs> {
        std::fs::create_dir_all(root).map_err(|source| JobsError::DataDir {
            path: root.to_owned(),
            source,
        })?;
        let objects = LocalFileSystem::new_with_prefix(root)?.with_fsync(true);
        Ok(Blobs {
            objects: Arc::new(objects),
            root: Some(root.to_owned()),
        })
    }

    /// Keeps results in an object store, which is the folder `root` if there is one.
    #[must_use]
    pub fn at(objects: Arc<dyn ObjectStore>, root: Option<PathBuf>) -> Blobs {
        Blobs { objects, root }
    }

    /// Stores a result and returns its key; durable once it returns. For a slice of a sweep, `{lease token}-{number of the slice}` stands in
    /// place of the lease token.
    ///
    /// # Errors
    /// The result could not be written.
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

    /// Reads a stored solution as JSON text.
    ///
    /// # Errors
    /// It cannot be read.
    pub async fn solution(&self, folder: &str) -> Result<Bytes> {
        let path = Path::from(folder).join(SOLUTION);
        Ok(self.objects.get(&path).await?.bytes().await?)
    }

    /// Reads the answers of a chunk of rows.
    ///
    /// # Errors
    /// They cannot be read.
    pub async fn chunk_answers(&self, folder: &str) -> Result<Bytes> {
        let path = Path::from(folder).join(ROWS);
        Ok(self.objects.get(&path).await?.bytes().await?)
    }

    /// Size of a stored solution, and its text without the closing brace, read while it is taken.
    ///
    /// # Errors
    /// It cannot be read, or is no object.
    pub async fn open_solution(
        &self,
        folder: &str,
    ) -> Result<(usize, BoxStream<'static, Result<Bytes>>)> {
        let path = Path::from(folder).join(SOLUTION);
        // One request brings all of a solution that is not large, and the size of one that is.
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

    /// Reads a whole stored result.
    ///
    /// # Errors
    /// It cannot be read.
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

    /// Reads the cells of one patch, with the values of one motion or of all of them, and nothing else.
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
        let body = PREFIX_BYTES
            + header_length(&start[..start.len().min(PREFIX_BYTES)]).map_err(damaged)?;
        let header = match start.get(PREFIX_BYTES..body) {
            Some(header) => Header::read(header),
            None => {
                let range = PREFIX_BYTES as u64..body as u64;
                Header::read(&self.objects.get_range(&path, range).await?)
            }
        };
        let header = header.map_err(damaged)?;
        let body = body as u64;
        let points = header.points(patch);
        if point.is_some_and(|point| point >= points) {
            return Err(JobsError::NoSuchPoint(points));
        }
        let ranges: Vec<_> = header
            .ranges(patch, point)
            .into_iter()
            .map(|range| range.start + body..range.end + body)
            .collect();
        let pieces = self.objects.get_ranges(&path, &ranges).await?;
        // Decompression is arithmetic; it stays off the threads that answer requests.
        let decoded = blocking(move || header.decode(patch, point, &pieces.concat()));
        decoded.await?.map_err(damaged)
    }

    /// Writes so many bytes and removes them again.
    ///
    /// # Errors
    /// They could not be written.
    pub(crate) async fn try_write(&self, bytes: usize) -> Result<()> {
        let path = Path::from(ROOT).join(format!("probe-{}", Uuid::now_v7()));
        let written = self.objects.put(&path, vec![0; bytes].into()).await;
        written?;
        Ok(self.objects.delete(&path).await?)
    }

    /// Copies the result under a key to another place, where it has the same key; its bytes, or `None` if it is not there.
    ///
    /// # Errors
    /// It cannot be read or written.
    pub async fn copy(&self, key: &str, to: &Blobs) -> Result<Option<u64>> {
        let folder = Path::from(key);
        let mut bytes = 0;
        // The solution last, as it is written.
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

    /// Removes the result under a key; one that is gone already is no error.
    ///
    /// # Errors
    /// Something could not be removed.
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

    /// Removes an emptied local folder with what a killed process may have left half-written in it, which the blob
    /// store does not show, and the folder of its job once that is empty.
    async fn scrub(&self, folder: &Path) -> Result<()> {
        let Some(root) = &self.root else {
            return Ok(());
        };
        let path = root.join(folder.as_ref());
        match tokio::fs::remove_dir_all(&path).await {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                return Err(JobsError::DataDir { path, source });
            }
            _ => {}
        }
        if let Some(job) = path.parent() {
            // It stays as long as another attempt lies in it.
            let _ = tokio::fs::remove_dir(job).await;
        }
        Ok(())
    }

    /// Keeps what was just written from everybody else on this machine.
    async fn make_private(&self, folder: &Path) -> Result<()> {
        let Some(root) = &self.root else {
            return Ok(());
        };
        let path = root.join(folder.as_ref());
        let failed = |source| JobsError::DataDir {
            path: path.clone(),
            source,
        };
        for name in [SOLUTION, FIELDS, ROWS] {
            let mode = Permissions::from_mode(0o600);
            match tokio::fs::set_permissions(path.join(name), mode).await {
                Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                    return Err(failed(source));
                }
                _ => {}
            }
        }
        Ok(())
    }
}

/// Where everything stored for a job lies.
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
    /// Everything that is stored, in the order of the keys: the job, the key, and when it was written, in epoch milliseconds.
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

    /// The keys of everything that is stored, job by job, month by month.
    ///
    /// # Errors
    /// The store cannot be listed.
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

    /// The months in which something is stored.
    ///
    /// # Errors
    /// The store cannot be listed.
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
        // What a process killed in the middle of a write leaves behind.
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
