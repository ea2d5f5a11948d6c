//! The stored form of a result.

use bytes::Bytes;
use serde::Serialize;

use crate::codec::fields::Header;
use crate::error::{JobsError, Result};
use railhead_contact::solution::words::answer::PatchFields;
use railhead_tables::parquet;

/// The stored form of a result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EncodedResult {
    /// The solution as JSON.
    pub solution: Bytes,
    /// The fields as written by [`encode`](crate::codec::fields::encode), or the table of a chunk of rows; `None` if the
    /// case requested no fields.
    pub fields: Option<Bytes>,
}

impl EncodedResult {
    /// Encodes a solution, or a part of one, that has no fields.
    ///
    /// # Errors
    /// JSON serialisation failed.
    pub fn as_json(answer: &impl Serialize) -> Result<EncodedResult, String> {
        let text = serde_json::to_vec(answer);
        let text =
            text.map_err(|error| format!("the answer cannot be written as JSON: {error}"))?;
        Ok(EncodedResult {
            solution: Bytes::from(text),
            fields: None,
        })
    }

    /// Size in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.solution.len() + self.fields.as_ref().map_or(0, Bytes::len)
    }

    /// Whether this is the result of a chunk of rows, with a table instead of fields.
    #[must_use]
    pub fn is_rows(&self) -> bool {
        let fields = self.fields.as_ref();
        fields.is_some_and(|fields| fields.starts_with(parquet::MAGIC))
    }

    /// Decodes the cells of one patch, with the values of one motion or of all motions.
    ///
    /// # Errors
    /// The motion does not exist, or the fields cannot be decoded.
    pub fn patch_fields(&self, patch: usize, point: Option<usize>) -> Result<PatchFields> {
        let file = self.fields.as_deref().unwrap_or_default();
        let damaged = |error: String| JobsError::Damaged(format!("stored fields: {error}"));
        let cut = || damaged("cut short".to_owned());
        let header = Header::read(file).map_err(damaged)?;
        let header = header.map_err(|_| cut())?;
        let mut pieces = Vec::new();
        for range in header.ranges(patch, point)? {
            let start = usize::try_from(range.start).unwrap_or(usize::MAX);
            let end = usize::try_from(range.end).unwrap_or(usize::MAX);
            pieces.extend_from_slice(file.get(start..end).ok_or_else(cut)?);
        }
        header.decode(patch, point, &pieces).map_err(damaged)
    }
}
