//! The formats of answers: what each is called in `?format=`, and its content type.

use axum::body::Body;
use axum::http::{HeaderName, HeaderValue, header};
use axum::response::{IntoResponse, Response};
use railhead_macros::Named;
use railhead_tables::read::TableForm;

/// A form in which something can be answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Named)]
pub enum Format {
    /// `application/json`.
    Json,
    /// `application/x-ndjson`: one JSON value per line.
    Ndjson,
    /// `text/csv`.
    Csv,
    /// NumPy's archive of arrays.
    Npz,
    /// Legacy VTK, binary.
    Vtk,
    /// A picture as SVG.
    Svg,
    /// A picture as PNG.
    Png,
    /// Arrow's stream of columns.
    Arrow,
    /// A Parquet file.
    Parquet,
    /// Server-sent events.
    Events,
}

impl Format {
    /// As the form of a table; NDJSON for what is none.
    pub(crate) fn table(self) -> TableForm {
        match self {
            Format::Csv => TableForm::Csv,
            Format::Arrow => TableForm::Arrow,
            Format::Parquet => TableForm::Parquet,
            _ => TableForm::Ndjson,
        }
    }

    /// The content type of the answer.
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

    /// An answer in this form, which `Accept` may have chosen; `name` as in [`Format::disposition`].
    pub(crate) fn answer(self, name: &str, body: impl Into<Body>) -> Response {
        let head = [
            (header::CONTENT_TYPE, self.media_type()),
            (header::VARY, "Accept"),
        ];
        let mut response = (head, body.into()).into_response();
        response.headers_mut().extend(self.disposition(name));
        response
    }

    /// The header `Content-Disposition` of an answer in this form, under which a browser saves it as `name` with the usual extension. Pictures are shown
    /// where they stand, tables and archives are saved; JSON has none.
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
