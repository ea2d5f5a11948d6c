//! `GET /v1/batches`: the batches of the tenant, filtered, page by page.

use axum::Json;
use axum::http::Uri;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

use crate::http::dto::batch::BatchAnswer;
use crate::http::extract::caller::Caller;
use crate::http::extract::labels::{label, name, time};
use crate::http::extract::query::{Parameters, Repeated, count, query, reader};
use crate::http::problem::error::ApiError;
use crate::http::routes::job_list::{ListProblems, ListTotal};
use crate::http::routes::next_page::link_next;
use crate::jobs::{BATCH_PAGE_MAX, BatchFilter};

/// Batches in one page of a list when nothing is said.
const LIST_LIMIT_DEFAULT: u32 = 20;

/// A page of batches, newest first.
#[derive(Debug, Serialize, ToSchema)]
pub struct BatchPage {
    /// The batches of this page.
    batches: Vec<BatchAnswer>,
    /// Give this as `cursor` for the next page; null on the last one.
    next_cursor: Option<String>,
    #[serde(flatten)]
    count: ListTotal,
}

query! {
    /// Filters and page of a list of batches.
    BatchListQuery(() => ()) {
        /// Only batches with this label, written `key:value`; may be repeated for batches that have all of them
        #[param(example = json!(["line:A12"]))]
        label: Vec<(String, String)> as Vec<String> = Repeated(label());
        /// Only batches whose name contains this text; the letters A to Z match in either case
        #[param(min_length = 1, max_length = 200, example = "timetable")]
        name: String as String = name();
        /// Only batches submitted at or after this time (RFC 3339)
        #[param(format = "date-time", example = "2026-01-31T09:30:00Z")]
        created_after: i64 as String = time();
        /// Only batches submitted before this time (RFC 3339)
        #[param(format = "date-time")]
        created_before: i64 as String = time();
        /// Batches in one page; 20 when left out
        #[param(minimum = 1, maximum = 100)]
        limit: u32 as u32 = count(1, BATCH_PAGE_MAX);
        /// `next_cursor` of the page before, with the same filters
        #[param(pattern = "^[0-9a-f]{40}$")]
        cursor: String as String = reader("a cursor of this service", |text| Some(text.to_owned()));
    }
}

/// Lists batches, newest first.
#[utoipa::path(
    get,
    path = "/v1/batches",
    tag = "batches",
    operation_id = "list_batches",
    params(BatchListQuery),
    responses((status = 200, description = "A page of batches", body = BatchPage, headers(
        ("Link" = String, description = "The next page (`rel=next`), unless this is the last one")
    )), ListProblems)
)]
pub async fn list(Caller(jobs): Caller, uri: Uri) -> Result<Response, ApiError> {
    let query = BatchListQuery::read(&uri, &())?;
    let filter = BatchFilter {
        labels: query.label.unwrap_or_default(),
        name: query.name,
        created_after: query.created_after,
        created_before: query.created_before,
    };
    let limit = query.limit.unwrap_or(LIST_LIMIT_DEFAULT);
    let page = jobs
        .batches(&filter, query.cursor.as_deref(), limit)
        .await?;
    let cursor = page.next_cursor.clone();
    let page = BatchPage {
        batches: page.entries.into_iter().map(BatchAnswer::from).collect(),
        next_cursor: page.next_cursor,
        count: page.total.into(),
    };
    let response = Json(page).into_response();
    Ok(link_next(&uri, cursor.as_deref(), response))
}
