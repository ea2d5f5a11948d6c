//! Lists of jobs, batches, runs and evolutions, newest first, page by page.

use std::sync::LazyLock;

use axum::Json;
use axum::http::{HeaderValue, Uri, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use serde::Serialize;
use serde_json::{Value, json};
use utoipa::openapi::path::{OperationBuilder, ParameterIn};
use utoipa::openapi::{HttpMethod, RefOr, Schema};
use utoipa::{IntoParams, PartialSchema};
use utoipa_axum::router::OpenApiRouter;
use uuid::Uuid;

use crate::dto::JobAnswer;
use crate::extract::caller::Caller;
use crate::extract::query::{
    Parameters, Query, Reader, count, label, list as list_reader, name, query, reader, repeated,
    time,
};
use crate::problem::{ApiError, ProblemKind, Result, describe};
use crate::routes::work::{WorkAnswer, answer_name, json_answer, route, schema, text_header};
use crate::state::AppState;
use railhead_jobs::model::{Kind, State as JobState};
use railhead_jobs::{Filter, Membership, PAGE_MAX, Total};

/// Default number of entries of a page.
pub(crate) const LIMIT_DEFAULT: u32 = 50;

/// Members of a job in a list, which `fields` can name.
static MEMBERS: LazyLock<Vec<String>> = LazyLock::new(|| match JobAnswer::schema() {
    RefOr::T(Schema::Object(job)) => {
        let members = job.properties.into_iter().map(|(name, _)| name);
        members
            .filter(|name| !["queue", "result"].contains(&name.as_str()))
            .collect()
    }
    _ => Vec::new(),
});

query! {
    /// The page of a list.
    PageQuery {
        /// Entries per page; default 50. Batches and runs: at most 100
        #[param(minimum = 1, maximum = 1000)]
        limit: u32 as u32 = count(1, PAGE_MAX);
        /// `next_cursor` of the previous page; the filters must be the same
        #[param(pattern = "^[0-9a-f]{40}$")]
        cursor: String as String = reader("a cursor of this service", |text| Some(text.to_owned()));
    }
}

query! {
    /// Filters of every kind of work.
    FilterQuery {
        /// Only entries with this label, written `key:value`; if repeated, entries with all of these labels
        #[param(example = json!(["line:A12"]))]
        label: Vec<(String, String)> as Vec<String> = repeated(label());
        /// Only entries whose name contains this text; case is ignored for the letters A to Z
        #[param(min_length = 1, max_length = 200, example = "crown")]
        name: String as String = name();
        /// Only entries submitted at or after this time (RFC 3339)
        #[param(format = "date-time", example = "2026-01-31T09:30:00Z")]
        created_after: i64 as String = time();
        /// Only entries submitted before this time (RFC 3339)
        #[param(format = "date-time")]
        created_before: i64 as String = time();
    }
}

query! {
    /// Filters of jobs and evolutions, and their members in the list.
    StateQuery {
        /// Only entries in this state; if repeated, entries in any of these states
        state: Vec<JobState> as Vec<JobState> = repeated(reader(JobState::ALL.map(JobState::name).join(", "), JobState::from_name));
        /// Only entries that changed at or after this time (RFC 3339); a change of progress alone does not count
        #[param(format = "date-time")]
        updated_after: i64 as String = time();
        /// Comma-separated list of the members to return; default: all
        #[param(pattern = "^[a-z_]+(,[a-z_]+)*$", example = "id,state,progress")]
        fields: Vec<String> as String = fields();
    }
}

query! {
    /// The filter by batch.
    MemberQuery {
        /// Only jobs of this batch; `none` for jobs that were submitted alone
        #[param(pattern = "^(none|[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12})$", example = "none")]
        batch: Membership as String = member();
    }
}

/// Returns the reader of the id of a batch, or `none`.
fn member() -> Reader<Membership> {
    reader("the id of a batch, or `none`", |text| match text {
        "none" => Some(Membership::Alone),
        id => Uuid::try_parse(id).ok().map(Membership::Batch),
    })
}

fn fields() -> Reader<Vec<String>> {
    let allowed = format!("a comma-separated list of {}", MEMBERS.join(", "));
    list_reader(allowed, |name| {
        MEMBERS.iter().find(|known| *known == name).cloned()
    })
}

/// Returns `GET` of the list of a kind.
pub(crate) fn list(kind: Kind) -> OpenApiRouter<AppState> {
    let handler = move |Caller(jobs): Caller, uri: Uri| async move {
        list_work(kind, Caller(jobs), &uri).await
    };
    let nouns = kind.nouns();
    let link = text_header("The next page (`rel=next`); absent on the last page");
    let found = json_answer(&page_name(kind), &format!("A page of {nouns}")).header("Link", link);
    let mut listing = OperationBuilder::new()
        .operation_id(Some(format!("list_{nouns}")))
        .tag(nouns)
        .summary(Some(format!("Lists {nouns}, newest first.")))
        .parameters(Some(groups(kind).1))
        .response("200", found.build());
    if has_states(kind) {
        listing = listing.description(Some(
            "The filters `name`, `updated_after`, a second `label`, and `label` with `batch=none` examine at most 20 000 entries \
             per page. Such a page may have fewer entries than requested, or none, although `next_cursor` is present.",
        ));
    }
    for (status, response) in describe(&[ProblemKind::BadQuery]) {
        listing = listing.response(status, response);
    }
    let (mut schemas, paths, handler) = route(kind, "", HttpMethod::Get, listing, get(handler));
    schemas.push((page_name(kind), page_schema(kind)));
    schemas.push(("ListedJob".to_owned(), listed_job()));
    OpenApiRouter::new().routes((schemas, paths, handler))
}

fn has_states(kind: Kind) -> bool {
    matches!(kind, Kind::Case | Kind::Evolution)
}

/// Returns the names of the parameters of a list, and their descriptions in the contract.
fn groups(kind: Kind) -> (Vec<&'static str>, Vec<utoipa::openapi::path::Parameter>) {
    fn add<P: Parameters + IntoParams>(
        (names, described): &mut (Vec<&'static str>, Vec<utoipa::openapi::path::Parameter>),
    ) {
        names.extend(P::names());
        described.extend(P::into_params(|| Some(ParameterIn::Query)));
    }
    let mut all = (Vec::new(), Vec::new());
    if kind == Kind::Case {
        add::<MemberQuery>(&mut all);
    }
    if has_states(kind) {
        add::<StateQuery>(&mut all);
    }
    add::<FilterQuery>(&mut all);
    add::<PageQuery>(&mut all);
    all
}

async fn list_work(kind: Kind, Caller(jobs): Caller, uri: &Uri) -> Result<Response> {
    let mut query = Query::read(uri, &groups(kind).0);
    let PageQuery { limit, cursor } = PageQuery::take(&mut query);
    let common = FilterQuery::take(&mut query);
    let own = StateQuery::take(&mut query);
    let MemberQuery { batch } = MemberQuery::take(&mut query);
    query.finish()?;
    let mut states = own.state.unwrap_or_default();
    states.sort_unstable();
    states.dedup();
    let filter = Filter {
        kind,
        states,
        member: batch,
        labels: common.label.unwrap_or_default(),
        name: common.name,
        created_after: common.created_after,
        created_before: common.created_before,
        updated_after: own.updated_after,
    };
    let jobs = jobs.of_kind(kind);
    let limit = limit.unwrap_or(LIMIT_DEFAULT);
    let page = jobs.list(&filter, cursor.as_deref(), limit).await?;
    let entries = page.entries.into_iter().map(|work| {
        let mut entry = serde_json::to_value(WorkAnswer::from(work))?;
        if let (Some(fields), Value::Object(members)) = (&own.fields, &mut entry) {
            members.retain(|name, _| fields.contains(name));
        }
        Ok::<_, serde_json::Error>(entry)
    });
    let entries = entries.collect::<Result<Vec<_>, _>>();
    let (count, number) = match page.total {
        Total::Exactly(number) => ("total", number),
        Total::AtLeast(number) => ("total_at_least", number),
    };
    let next = page.next_cursor.as_deref();
    let body = json!({
        kind.nouns(): entries.map_err(ApiError::internal)?,
        "next_cursor": next,
        count: number,
    });
    Ok(answer(uri, next, body))
}

/// Returns a page as a response, with a link to the next page (RFC 8288): the same URI with another cursor.
pub(crate) fn answer(uri: &Uri, cursor: Option<&str>, page: impl Serialize) -> Response {
    let mut response = Json(page).into_response();
    let Some(cursor) = cursor else {
        return response;
    };
    if let Ok(link) = HeaderValue::from_str(&link(uri, cursor)) {
        response.headers_mut().insert(header::LINK, link);
    }
    response
}

fn link(uri: &Uri, cursor: &str) -> String {
    let query = uri.query().unwrap_or_default().split('&');
    let others = query.filter(|pair| !pair.is_empty() && !pair.starts_with("cursor="));
    let others: String = others.map(|pair| format!("{pair}&")).collect();
    format!("<{}?{others}cursor={cursor}>; rel=\"next\"", uri.path())
}

fn page_name(kind: Kind) -> String {
    match kind {
        Kind::Evolution => "EvolutionPage".to_owned(),
        kind => format!("{}Page", answer_name(kind)),
    }
}

fn page_schema(kind: Kind) -> RefOr<Schema> {
    let entry = match has_states(kind) {
        true => "ListedJob",
        false => answer_name(kind),
    };
    let count = |about: &str| json!({ "type": "integer", "minimum": 0, "description": about });
    schema(json!({
        "type": "object",
        "description": format!("A page of {}, newest first", kind.nouns()),
        "required": [kind.nouns()],
        "properties": {
            kind.nouns(): { "type": "array", "items": { "$ref": format!("#/components/schemas/{entry}") } },
            "next_cursor": { "type": ["string", "null"], "description": "`cursor` of the next page; null on the last page" },
            "total": count("Number of entries in the whole list"),
            "total_at_least": count("Lower bound, in place of `total` if an exact count is too expensive"),
        },
    }))
}

/// Returns the schema of a job in a list, whose members are all optional. The schema of a job describes them.
fn listed_job() -> RefOr<Schema> {
    let mut schema = JobAnswer::schema();
    if let RefOr::T(Schema::Object(job)) = &mut schema {
        job.required.clear();
        for member in job.properties.values_mut() {
            if let RefOr::T(Schema::Object(member)) = member {
                member.description = None;
            }
        }
        job.description =
            Some("A job with all its members, or with those that `fields` names.".to_owned());
    }
    schema
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_of_a_listed_job_can_be_named() {
        assert!(MEMBERS.len() > 15, "{:?}", *MEMBERS);
        assert!(MEMBERS.contains(&"progress".to_owned()));
    }

    #[test]
    fn the_next_page_has_the_same_filters_and_another_cursor() {
        let link = |uri: &'static str, cursor| link(&Uri::from_static(uri), cursor);
        assert_eq!(link("/v1/jobs", "a"), "</v1/jobs?cursor=a>; rel=\"next\"");
        assert_eq!(
            link("/v1/jobs?state=queued&cursor=a&label=x:%C3%A4", "b"),
            "</v1/jobs?state=queued&label=x:%C3%A4&cursor=b>; rel=\"next\""
        );
    }
}
