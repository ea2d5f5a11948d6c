//! Submissions of every kind: name, labels, priority, deadline, idempotency key, wait, and the response.

use std::collections::BTreeMap;

use axum::body::Body;
use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::openapi::RefOr;
use utoipa::openapi::path::{Parameter, ParameterBuilder, ParameterIn};
use utoipa::{IntoParams, IntoResponses};

use crate::extract::caller::Caller;
use crate::extract::query::{
    LABELS_MAX, Parameters, SubmitQuery, name, new_label, query, repeated,
};
use crate::limits::{Memory, Permit, hold_while_sent};
use crate::problem::{ApiError, Fault, Result, seconds_header};
use crate::render::format::Format;
use crate::routes::results::result_text;
use crate::routes::wait::{Wait, WaitQuery};
use crate::routes::work::{
    WorkAnswer, header_parameter, json_answer, prefer, text as text_schema, text_header,
};
use crate::state::AppState;
use railhead_jobs::Jobs;
use railhead_jobs::model::{Kind, Labels, State as JobState, WorkOptions};
use railhead_jobs::work::Work;

/// Longest idempotency key in characters.
const IDEMPOTENCY_KEY_MAX_CHARS: usize = 255;

const IDEMPOTENCY_REPLAYED: HeaderName = HeaderName::from_static("idempotency-replayed");
const IDEMPOTENCY_KEY: HeaderName = HeaderName::from_static("idempotency-key");

query! {
    /// Name and labels of work whose body does not contain them.
    NamedQuery {
        /// Free text given by the client
        #[param(min_length = 1, max_length = 200, example = "timetable 2026")]
        name: String as String = name();
        /// A label, written `key:value`; may be repeated for up to 32 labels with different keys
        #[param(max_items = 32, example = json!(["line:A12"]))]
        label: Vec<(String, String)> as Vec<String> = repeated(new_label());
    }
}

impl NamedQuery {
    /// Sets the name and the labels of the options, with the labels of the API key.
    ///
    /// # Errors
    /// There are too many labels, two have the same key, or one contradicts the API key.
    pub(crate) fn read_into(self, options: &mut WorkOptions, jobs: &Jobs) -> Result<()> {
        let given = self.label.unwrap_or_default();
        let number = given.len();
        let mut labels: Labels = given.into_iter().collect();
        if labels.len() < number || number > LABELS_MAX {
            let detail = format!(
                "{number} labels are given; at most {LABELS_MAX} with different keys are allowed"
            );
            return Err(ApiError::bad_parameter("label", detail));
        }
        jobs.bind(&mut labels)
            .map_err(|faults| ApiError::bad_parameter("label", faults[0].detail.clone()))?;
        (options.name, options.labels) = (self.name, labels);
        Ok(())
    }
}

/// The query and the headers of a submission; `P` are the parameters of its kind.
pub(crate) struct Submission<P> {
    pub(crate) jobs: Jobs,
    pub(crate) own: P,
    pub(crate) options: WorkOptions,
    pub(crate) reply: Reply,
}

/// The response to a submission, after a wait.
pub(crate) struct Reply(Wait);

impl<P: Parameters> FromRequestParts<AppState> for Submission<P> {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self> {
        let Caller(jobs) = Caller::from_request_parts(parts, state).await?;
        let wait = Wait::from_request_parts(parts, state).await?;
        let idempotency_key = idempotency_key(&parts.headers)?;
        let ((own, submit), _) = <((P, SubmitQuery), WaitQuery)>::read(&parts.uri)?;
        Ok(Submission {
            own,
            options: WorkOptions {
                idempotency_key,
                ..submit.options(&parts.headers).into()
            },
            reply: Reply(wait),
            jobs,
        })
    }
}

/// The JSON of submitted work.
#[derive(Serialize)]
struct Submitted {
    #[serde(flatten)]
    work: WorkAnswer,
    /// Faults of skipped cases.
    #[serde(skip_serializing_if = "Option::is_none")]
    errors: Option<Vec<Fault>>,
}

impl Reply {
    /// Answers with the work after the requested wait. The response for a job that succeeded in time contains its result.
    ///
    /// # Errors
    /// The work cannot be written as JSON.
    pub(crate) async fn send(
        self,
        jobs: &Jobs,
        memory: &Memory,
        (mut work, replayed): (Work, bool),
        errors: Option<Vec<Fault>>,
    ) -> Result<Response> {
        let Reply(wait) = self;
        let jobs = jobs.of_kind(work.kind());
        let (id, ended) = (work.id(), work.ended());
        // The work is stored. The client must learn its id even if the wait ends early.
        let waited = wait.hold(&jobs, async |at_most| match ended {
            true => Ok(None),
            false => jobs.wait_for(id, at_most).await.map(Some),
        });
        match waited.await {
            Ok(Some(Ok(Some(later)))) => work = later,
            Ok(Some(Err(reason))) => {
                tracing::debug!(%reason, work = %work.id(), "the wait ended early");
            }
            Ok(Some(Ok(None)) | None) | Err(_) => {}
        }
        let in_time = wait.at_most().is_some() && work.ended();
        let location = format!("/v1/{}/{}", work.kind().nouns(), work.id());
        let (body, share) = text(&jobs, memory, work, errors, in_time).await?;
        let status = match in_time {
            true => StatusCode::OK,
            false => StatusCode::ACCEPTED,
        };
        let head = [
            (header::LOCATION, location.as_str()),
            (header::CONTENT_TYPE, Format::Json.media_type()),
        ];
        let mut response = hold_while_sent((status, head, body).into_response(), share);
        let headers = response.headers_mut();
        if !in_time {
            headers.insert(header::RETRY_AFTER, HeaderValue::from(1));
        }
        if replayed {
            headers.insert(IDEMPOTENCY_REPLAYED, HeaderValue::from_static("true"));
        }
        Ok(wait.tell_applied(response))
    }
}

/// Returns work as JSON, with the result of a job if it can be read, and the permit for its memory.
async fn text(
    jobs: &Jobs,
    memory: &Memory,
    work: Work,
    errors: Option<Vec<Fault>>,
    in_time: bool,
) -> Result<(Body, Option<Permit>)> {
    let solved = match &work {
        Work::Job(job) => in_time && job.kind == Kind::Case && job.state == JobState::Succeeded,
        _ => false,
    };
    let id = work.id();
    let work = work.into();
    let text = serde_json::to_string(&Submitted { work, errors });
    let text = text.map_err(ApiError::internal)?;
    if solved && let Some(open) = text.strip_suffix('}') {
        // The client must learn the id of the job even if the result cannot be read.
        match result_text(jobs, memory, id, [&format!("{open},\"result\":"), "}"]).await {
            Ok(answer) => return Ok(answer),
            Err(error) => tracing::error!(?error, job = %id, "a result cannot be read"),
        }
    }
    Ok((Body::from(text), None))
}

/// Returns the idempotency key of a request.
fn idempotency_key(headers: &HeaderMap) -> Result<Option<String>> {
    let Some(value) = headers.get(&IDEMPOTENCY_KEY) else {
        return Ok(None);
    };
    let key = value.to_str().unwrap_or_default();
    let allowed = 1..=IDEMPOTENCY_KEY_MAX_CHARS;
    let visible = key.bytes().all(|byte| byte.is_ascii_graphic());
    if visible
        && allowed.contains(&key.len())
        && headers.get_all(&IDEMPOTENCY_KEY).iter().count() == 1
    {
        return Ok(Some(key.to_owned()));
    }
    Err(ApiError::bad_header(
        "Idempotency-Key",
        format!(
            "`Idempotency-Key` is one value of 1 to {IDEMPOTENCY_KEY_MAX_CHARS} visible ASCII characters"
        ),
    ))
}

/// Describes the parameters of every submission in the contract.
pub(crate) struct SubmitParameters;

impl IntoParams for SubmitParameters {
    fn into_params(place: impl Fn() -> Option<ParameterIn>) -> Vec<Parameter> {
        let key = text_schema()
            .min_length(Some(1))
            .max_length(Some(IDEMPOTENCY_KEY_MAX_CHARS))
            .pattern(Some("^[!-~]+$"));
        let key = header_parameter(
            "Idempotency-Key",
            "1 to 255 visible ASCII characters. A repetition with the same key, body and options returns what the first request created",
        )
        .schema(Some(key));
        let cache = header_parameter(
            "Cache-Control",
            "`no-cache`: solve every case, even if the result of an identical case is stored",
        )
        .example(Some("no-cache".into()));
        let trace = header_parameter(
            "traceparent",
            "W3C trace context: if the service exports traces, the trace of the work continues the client's trace. An unreadable value is ignored",
        )
        .example(Some("00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01".into()));
        let mut all = SubmitQuery::into_params(&place);
        all.extend(WaitQuery::into_params(&place));
        all.extend([prefer(), key, cache, trace].map(ParameterBuilder::build));
        all
    }
}

/// Declares the responses to accepted submissions in the contract.
macro_rules! accepted {
    ($name:ident: $schema:literal) => {
        pub(crate) struct $name;

        impl IntoResponses for $name {
            fn responses() -> BTreeMap<String, RefOr<utoipa::openapi::Response>> {
                accepted_as($schema)
            }
        }
    };
}
accepted!(JobAccepted: "Job");
accepted!(BatchAccepted: "BatchReceipt");
accepted!(RunAccepted: "Run");

fn accepted_as(schema: &str) -> BTreeMap<String, RefOr<utoipa::openapi::Response>> {
    let response = |about: &str| {
        json_answer(schema, about)
            .header("Location", text_header("Path of the created resource"))
            .header(
                "Preference-Applied",
                text_header("The wait that was applied, if one was requested"),
            )
            .header(
                "Idempotency-Replayed",
                text_header("`true` if an earlier request with the same `Idempotency-Key` created this; absent otherwise"),
            )
    };
    let again = seconds_header("Seconds to wait before asking again");
    let stored =
        response("The submission is stored and will be solved").header("Retry-After", again);
    let ended = response("The work ended within the wait");
    BTreeMap::from([
        ("200".to_owned(), ended.build().into()),
        ("202".to_owned(), stored.build().into()),
    ])
}
