//! A result in its stored form.

use bytes::Bytes;
use serde::Serialize;

use crate::codec::fields::{Header, PREFIX_BYTES, header_length};
use crate::error::{JobsError, Result};
use railhead_contact::solution::words::answer::PatchFields;
use railhead_tables::parquet;

/// A result in its stored form.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EncodedResult {
    /// The solution as JSON.
    pub solution: Bytes,
    /// The fields as [`encode`](crate::codec::encode::encode) writes them, if the case asked for any.
    pub fields: Option<Bytes>,
}

impl EncodedResult {
    /// Encodes an answer, or a part of one, that has no fields.
    ///
    /// # Errors
    /// The answer cannot be written as JSON, and why.
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

    /// These are the answers of a chunk of rows, whose table stands in place of fields.
    #[must_use]
    pub fn is_rows(&self) -> bool {
        let fields = self.fields.as_ref();
        fields.is_some_and(|fields| fields.starts_with(parquet::MAGIC))
    }

    /// The cells of one patch, with the values of one motion or of all of them.
    ///
    /// # Errors
    /// There is no such motion, or the fields cannot be read.
    pub fn patch_fields(&self, patch: usize, point: Option<usize>) -> Result<PatchFields> {
        let file = self.fields.as_deref().unwrap_or_default();
        let damaged = |error: String| JobsError::Damaged(format!("stored fields: {error}"));
        let prefix = file.get(..PREFIX_BYTES).unwrap_or_default();
        let body = PREFIX_BYTES + header_length(prefix).map_err(damaged)?;
        let cut = || damaged("cut short".to_owned());
        let header =
            Header::read(file.get(PREFIX_BYTES..body).ok_or_else(cut)?).map_err(damaged)?;
        let points = header.points(patch);
        if point.is_some_and(|point| point >= points) {
            return Err(JobsError::NoSuchPoint(points));
        }
        let mut pieces = Vec::new();
        for range in header.ranges(patch, point) {
            let start = usize::try_from(range.start).unwrap_or(usize::MAX);
            let end = usize::try_from(range.end).unwrap_or(usize::MAX);
            let piece = file[body..].get(start..end).ok_or_else(cut)?;
            pieces.extend_from_slice(piece);
        }
        header.decode(patch, point, &pieces).map_err(damaged)
    }
}
