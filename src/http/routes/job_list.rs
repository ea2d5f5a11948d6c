//! `GET /v1/jobs`: the jobs of the tenant, filtered, page by page.

use axum::http::Uri;
use axum::response::Response;
use serde::Serialize;
use serde_json::Value;
use utoipa::openapi::{RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};
use uuid::Uuid;

use crate::http::dto::job::JobAnswer;
use crate::http::extract::caller::Caller;
use crate::http::extract::labels::time;
use crate::http::extract::query::{Parameters, Reader, Repeated, count, reader};
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::routes::next_page::{answer, list_query};
use crate::jobs::model::job::State as JobState;
use crate::jobs::{Filter, Membership, PAGE_MAX, Total};

/// Jobs in one page of a list when nothing is said.
const LIST_LIMIT_DEFAULT: u32 = 50;

/// Members of a job that `fields` can name.
const MEMBERS: [&str; 18] = [
    "id",
    "state",
    "name",
    "labels",
    "batch_id",
    "priority",
    "created_at",
    "updated_at",
    "started_at",
    "ended_at",
    "deadline_at",
    "expires_at",
    "attempt",
    "cached",
    "progress",
    "remarks",
    "error",
    "links",
];

/// A page of jobs, newest first.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct JobPage {
    /// The jobs of this page; with the members that `fields` names.
    #[schema(value_type = Vec<ListedJob>)]
    jobs: Vec<Value>,
    /// Give this as `cursor` for the next page; null on the last one.
    next_cursor: Option<String>,
    #[serde(flatten)]
    count: ListTotal,
}

/// Number of entries of a list: one of the two is there.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ListTotal {
    /// Number of entries of the whole list.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    total: Option<u64>,
    /// Lower bound of the number of entries, given instead of `total` if an exact count would be too expensive.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    total_at_least: Option<u64>,
}

impl From<Total> for ListTotal {
    fn from(total: Total) -> Self {
        let (total, total_at_least) = match total {
            Total::Exactly(number) => (Some(number), None),
            Total::AtLeast(number) => (None, Some(number)),
        };
        ListTotal {
            total,
            total_at_least,
        }
    }
}

/// A job in a list, in the contract: any of its members may have been left out.
pub(crate) struct ListedJob;

impl PartialSchema for ListedJob {
    fn schema() -> RefOr<Schema> {
        let mut schema = JobAnswer::schema();
        if let RefOr::T(Schema::Object(job)) = &mut schema {
            job.required.clear();
            job.description =
                Some("A job, with all its members or those that `fields` names.".to_owned());
        }
        schema
    }
}

impl ToSchema for ListedJob {
    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        JobAnswer::schemas(schemas);
    }
}

problems! {
    /// What `GET /v1/jobs` can fail with.
    ListProblems: BadQuery
}

list_query! {
    /// Filters and page of a list of jobs.
    ListQuery {
        /// Only jobs in this state; may be repeated for jobs in one of several
        state: Vec<JobState> as Vec<JobState> = Repeated(reader(JobState::ALL.map(JobState::name).join(", "), JobState::from_name));
        /// Only jobs of this batch; `none` for jobs that were submitted alone
        #[param(pattern = "^(none|[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12})$", example = "none")]
        batch: Membership as String = member();
        /// Only jobs that changed at or after this time (RFC 3339), progress aside
        #[param(format = "date-time")]
        updated_after: i64 as String = time();
        /// Members of the jobs to answer, with commas between; all when left out
        #[param(pattern = "^[a-z_]+(,[a-z_]+)*$", example = "id,state,progress")]
        fields: Vec<&'static str> as String = fields();
        /// Jobs in one page; 50 when left out
        #[param(minimum = 1, maximum = 1000)]
        limit: u32 as u32 = count(1, PAGE_MAX);
    }
}

/// The id of a batch, or `none`.
fn member() -> Reader<Membership> {
    reader("the id of a batch, or `none`", |text| match text {
        "none" => Some(Membership::Alone),
        id => Uuid::try_parse(id).ok().map(Membership::Batch),
    })
}

/// Names of members with commas between.
fn fields() -> Reader<Vec<&'static str>> {
    reader(
        format!("names with commas between, of {}", MEMBERS.join(", ")),
        |text| {
            let member = |name: &str| MEMBERS.into_iter().find(|member| *member == name);
            text.split(',').map(member).collect()
        },
    )
}

/// Lists jobs, newest first.
///
/// A filter by `name`, `updated_after` or a second `label` examines every job that matches the other filters, up to 20 000 per page: such a page
/// may have fewer jobs than asked for, or none, although `next_cursor` is there.
#[utoipa::path(
    get,
    path = "/v1/jobs",
    tag = "jobs",
    operation_id = "list_jobs",
    params(ListQuery),
    responses((status = 200, description = "A page of jobs", body = JobPage, headers(
        ("Link" = String, description = "The next page (`rel=next`), unless this is the last one")
    )), ListProblems)
)]
pub(crate) async fn list(Caller(jobs): Caller, uri: Uri) -> Result<Response, ApiError> {
    let query = ListQuery::read(&uri, &())?;
    let mut states = query.state.unwrap_or_default();
    states.sort_unstable();
    states.dedup();
    let filter = Filter {
        states,
        member: query.batch,
        labels: query.label.unwrap_or_default(),
        name: query.name,
        created_after: query.created_after,
        created_before: query.created_before,
        updated_after: query.updated_after,
        ..Filter::default()
    };
    let limit = query.limit.unwrap_or(LIST_LIMIT_DEFAULT);
    let page = jobs.list(&filter, query.cursor.as_deref(), limit).await?;
    let shown = page.entries.into_iter().map(|job| {
        let mut job = serde_json::to_value(JobAnswer::new(job))?;
        if let (Some(fields), Value::Object(members)) = (&query.fields, &mut job) {
            members.retain(|name, _| fields.contains(&name.as_str()));
        }
        Ok::<_, serde_json::Error>(job)
    });
    let shown = shown.collect::<Result<_, _>>();
    let cursor = page.next_cursor.clone();
    let page = JobPage {
        jobs: shown.map_err(|error| ApiError::internal(&error))?,
        next_cursor: page.next_cursor,
        count: page.total.into(),
    };
    Ok(answer(&uri, cursor.as_deref(), page))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_member_of_a_listed_job_can_be_named() {
        let schema = serde_json::to_value(JobAnswer::schema()).unwrap();
        let members = schema["properties"].as_object().unwrap().keys();
        // These two are never in a list.
        let mut members: Vec<_> = members
            .filter(|name| !["queue", "result"].contains(&name.as_str()))
            .collect();
        let mut named = MEMBERS.to_vec();
        named.sort_unstable();
        members.sort_unstable();
        assert_eq!(members, named);
    }
}
