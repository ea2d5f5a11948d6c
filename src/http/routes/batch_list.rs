//! `GET /v1/batches`: the batches of the tenant, filtered, page by page.

use axum::http::Uri;
use axum::response::Response;
use serde::Serialize;
use utoipa::ToSchema;

use crate::http::dto::batch::BatchAnswer;
use crate::http::extract::caller::Caller;
use crate::http::extract::query::{Parameters, count};
use crate::http::problem::error::ApiError;
use crate::http::routes::job_list::{ListProblems, ListTotal};
use crate::http::routes::next_page::{answer, list_query};
use crate::jobs::model::kind::Kind;
use crate::jobs::{BATCH_PAGE_MAX, BatchFilter};

/// Batches in one page of a list when nothing is said.
const LIST_LIMIT_DEFAULT: u32 = 20;

/// A page of batches, newest first.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct BatchPage {
    /// The batches of this page.
    batches: Vec<BatchAnswer>,
    /// Give this as `cursor` for the next page; null on the last one.
    next_cursor: Option<String>,
    #[serde(flatten)]
    count: ListTotal,
}

list_query! {
    /// Filters and page of a list of batches.
    BatchListQuery {
        /// Batches in one page; 20 when left out
        #[param(minimum = 1, maximum = 100)]
        limit: u32 as u32 = count(1, BATCH_PAGE_MAX);
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
pub(crate) async fn list(Caller(jobs): Caller, uri: Uri) -> Result<Response, ApiError> {
    let query = BatchListQuery::read(&uri, &())?;
    let filter = BatchFilter {
        kind: Kind::Cases,
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
    Ok(answer(&uri, cursor.as_deref(), page))
}
