//! Large results in the database: an object store of pieces, with reads by range.

use std::fmt;
use std::ops::Range;

use async_trait::async_trait;
use bytes::Bytes;
use futures_util::stream::{self, BoxStream};
use futures_util::{StreamExt, TryStreamExt};
use object_store::path::Path;
use object_store::{
    Attributes, CopyOptions, Error, GetOptions, GetResult, GetResultPayload, ListResult,
    MultipartUpload, ObjectMeta, ObjectStore, PutMultipartOptions, PutOptions, PutPayload,
    PutResult, Result,
};
use sqlx::postgres::PgPool;
use sqlx::{query, query_scalar};

/// Size of a piece in bytes.
const PIECE: u64 = 1 << 20;

/// Name of this store in errors.
const NAME: &str = "PostgreSQL";

/// Objects in a table of the database.
#[derive(Debug, Clone)]
pub struct PgObjects {
    pool: PgPool,
}

impl PgObjects {
    /// The objects of a database.
    pub(crate) fn new(pool: PgPool) -> PgObjects {
        PgObjects { pool }
    }

    async fn meta(&self, location: &Path) -> Result<ObjectMeta> {
        let size: Option<i64> = sql!(scalar fetch_optional, &self.pool,
            "SELECT size FROM objects WHERE path = $1 AND number = 0";
            location.as_ref()
        )
        .map_err(failed)?;
        match size {
            Some(size) => Ok(ObjectMeta {
                location: location.clone(),
                // Not used.
                last_modified: Default::default(),
                size: size.unsigned_abs(),
                e_tag: None,
                version: None,
            }),
            None => Err(missing(location)),
        }
    }

    /// The part of a range that is in one piece.
    async fn piece(&self, location: &Path, number: u64, range: &Range<u64>) -> Result<Bytes> {
        let start = number * PIECE;
        let body: Option<Vec<u8>> = sql!(scalar fetch_optional, &self.pool,
            "SELECT body FROM objects WHERE path = $1 AND number = $2";
            location.as_ref(), number.cast_signed()
        )
        .map_err(failed)?;
        // It may have been removed in the meantime.
        let body = Bytes::from(body.ok_or_else(|| missing(location))?);
        let place = |at: u64| usize::try_from(at.saturating_sub(start)).unwrap_or(usize::MAX);
        let (from, to) = (place(range.start), place(range.end).min(body.len()));
        Ok(body.slice(from.min(to)..to))
    }
}

impl fmt::Display for PgObjects {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(NAME)
    }
}

#[async_trait]
impl ObjectStore for PgObjects {
    async fn put_opts(
        &self,
        location: &Path,
        payload: PutPayload,
        _: PutOptions,
    ) -> Result<PutResult> {
        let body = Bytes::from(payload);
        let size = i64::try_from(body.len()).unwrap_or(i64::MAX);
        let mut pieces: Vec<&[u8]> = body.chunks(1 << 20).collect();
        if pieces.is_empty() {
            pieces.push(&[]);
        }
        let mut transaction = self.pool.begin().await.map_err(failed)?;
        sql!(execute, &mut *transaction, "DELETE FROM objects WHERE path = $1"; location.as_ref())
            .map_err(failed)?;
        for (number, piece) in (0_i64..).zip(pieces) {
            sql!(execute, &mut *transaction,
                "INSERT INTO objects (path, number, size, body) VALUES ($1, $2, $3, $4)";
                location.as_ref(), number, size, piece
            )
            .map_err(failed)?;
        }
        transaction.commit().await.map_err(failed)?;
        Ok(PutResult {
            e_tag: None,
            version: None,
            extensions: Default::default(),
        })
    }

    async fn put_multipart_opts(
        &self,
        _: &Path,
        _: PutMultipartOptions,
    ) -> Result<Box<dyn MultipartUpload>> {
        Err(not_done("put_multipart"))
    }

    async fn get_opts(&self, location: &Path, options: GetOptions) -> Result<GetResult> {
        let meta = self.meta(location).await?;
        let range = match &options.range {
            Some(range) => range.as_range(meta.size).map_err(failed)?,
            None => 0..meta.size,
        };
        let numbers = match options.head || range.is_empty() {
            true => 0..0,
            false => range.start / PIECE..range.end.div_ceil(PIECE),
        };
        let (objects, location, part) = (self.clone(), location.clone(), range.clone());
        let pieces = stream::iter(numbers)
            .then(move |number| {
                let (objects, location, part) = (objects.clone(), location.clone(), part.clone());
                async move { objects.piece(&location, number, &part).await }
            })
            .boxed();
        Ok(GetResult {
            payload: GetResultPayload::Stream(pieces),
            meta,
            range,
            attributes: Attributes::default(),
            extensions: Default::default(),
        })
    }

    fn delete_stream(
        &self,
        locations: BoxStream<'static, Result<Path>>,
    ) -> BoxStream<'static, Result<Path>> {
        let pool = self.pool.clone();
        locations
            .and_then(move |location| {
                let pool = pool.clone();
                async move {
                    let gone = sql!(execute, &pool,
                        "DELETE FROM objects WHERE path = $1";
                        location.as_ref()
                    )
                    .map_err(failed)?;
                    match gone.rows_affected() {
                        0 => Err(missing(&location)),
                        _ => Ok(location),
                    }
                }
            })
            .boxed()
    }

    /// Not supported, because results in the database are found by its tables.
    fn list(&self, _: Option<&Path>) -> BoxStream<'static, Result<ObjectMeta>> {
        stream::once(async { Err(not_done("list")) }).boxed()
    }

    async fn list_with_delimiter(&self, _: Option<&Path>) -> Result<ListResult> {
        Err(not_done("list_with_delimiter"))
    }

    async fn copy_opts(&self, _: &Path, _: &Path, _: CopyOptions) -> Result<()> {
        Err(not_done("copy"))
    }
}

fn failed(error: impl std::error::Error + Send + Sync + 'static) -> Error {
    Error::Generic {
        store: NAME,
        source: Box::new(error),
    }
}

fn missing(location: &Path) -> Error {
    Error::NotFound {
        path: location.to_string(),
        source: "there is no such object".into(),
    }
}

fn not_done(operation: &str) -> Error {
    Error::NotImplemented {
        operation: operation.to_owned(),
        implementer: NAME.to_owned(),
    }
}
