//! The formats of responses: their names in `?format=`, content types and file names.

use axum::body::Body;
use axum::http::{HeaderName, HeaderValue, header};
use axum::response::{IntoResponse, Response};
use railhead_macros::Named;
use railhead_tables::read::TableForm;

/// A format of a response.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Named)]
pub enum Format {
    /// `application/json`.
    Json,
    /// `application/x-ndjson`: one JSON value per line.
    Ndjson,
    /// `text/csv`.
    Csv,
    /// An archive of NumPy arrays.
    Npz,
    /// Legacy VTK, binary.
    Vtk,
    /// An SVG picture.
    Svg,
    /// A PNG picture.
    Png,
    /// An Arrow stream.
    Arrow,
    /// A Parquet file.
    Parquet,
    /// Server-sent events.
    Events,
}

impl Format {
    /// Returns the form of a table in this format; NDJSON for formats that are not tables.
    pub(crate) fn table(self) -> TableForm {
        match self {
            Format::Csv => TableForm::Csv,
            Format::Arrow => TableForm::Arrow,
            Format::Parquet => TableForm::Parquet,
            _ => TableForm::Ndjson,
        }
    }

    /// Returns the content type.
    #[must_use]
    pub fn media_type(self) -> &'static str {
        match self {
            Format::Json => "application/json",
            Format::Ndjson => "application/x-ndjson",
            Format::Csv => "text/csv; charset=utf-8",
            Format::Npz => "application/x-npz",
            Format::Vtk => "application/x-vtk",
            Format::Svg => "image/svg+xml",
            Format::Png => "image/png",
            Format::Arrow => "application/vnd.apache.arrow.stream",
            Format::Parquet => "application/vnd.apache.parquet",
            Format::Events => "text/event-stream",
        }
    }

    /// Returns a response in this format, which `Accept` may have selected; `name` as in [`Format::disposition`].
    pub(crate) fn answer(self, name: &str, body: impl Into<Body>) -> Response {
        let head = [
            (header::CONTENT_TYPE, self.media_type()),
            (header::VARY, "Accept"),
        ];
        let mut response = (head, body.into()).into_response();
        response.headers_mut().extend(self.disposition(name));
        response
    }

    /// Returns the header `Content-Disposition` with the file name `name` and the usual extension. Browsers show pictures, and save tables and
    /// archives; JSON has no such header.
    #[must_use]
    pub fn disposition(self, name: &str) -> Option<(HeaderName, HeaderValue)> {
        let kind = match self {
            Format::Json | Format::Events => return None,
            Format::Svg | Format::Png => "inline",
            _ => "attachment",
        };
        let value = format!("{kind}; filename=\"{name}.{}\"", self.name());
        let value = HeaderValue::from_str(&value).ok()?;
        Some((header::CONTENT_DISPOSITION, value))
    }
}
