//! `POST /v1/batches`: many cases in one request, followed and cancelled as one.

use axum::extract::{Request, State};
use axum::response::Response;
use uuid::Uuid;

use crate::http::dto::batch::Cases;
use crate::http::extract::batch::body::{form, read_draft};
use crate::http::extract::multipart::{TableUpload, separate_template};
use crate::http::extract::query::{id, query, word};
use crate::http::limits::memory::Memory;
use crate::http::options::HttpOptions;
use crate::http::problem::body::Fault;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::http::routes::submission::{BatchAccepted, NamedQuery, Submission, SubmitParameters};
use crate::jobs::batch::upload::BatchUpload;

problems! {
    /// What `POST /v1/batches` can fail with.
    BatchProblems: MalformedJson, UnreadableBody, BadQuery, BadHeader, BodyTimeout, BodyTooLarge, UnsupportedMediaType, UnsupportedEncoding,
    FaultyBatch, FaultyTable, JobNotFound, IdempotencyConflict, QuotaExceeded, StoredQuotaExceeded, QueueFull, Draining, StorageFull, StorageUnwritable, StorageUnreachable
}

query! {
    /// What the query of a submission says about the batch itself.
    BatchQuery(() => ()) {
        /// `reject` (when left out): one faulty case refuses the batch; `skip`: faulty cases are left out and reported
        #[param(pattern = "^(reject|skip)$", example = "skip")]
        on_invalid: bool as String = word(&[("reject", false), ("skip", true)]);
        /// The job whose case is the template of a table; not with `multipart/form-data`, which holds the template itself
        #[param(format = "uuid")]
        template: Uuid as String = id("job");
    }
}

/// Submits many cases as one batch of jobs.
///
/// The body is a JSON array of cases, one case per line (`application/x-ndjson`), or a table whose lines fill the cells of
/// a template case: as `multipart/form-data` with the parts `template` and `table`, or alone with `?template=` naming a job. Tables are CSV,
/// Arrow, Parquet or NPZ, and with a template also NDJSON with a row per line. JSON, NDJSON and CSV are read as they arrive. All jobs of
/// a batch answered with `202` are stored durably. Without `on_invalid=skip` one faulty case refuses the whole batch (`422`), and
/// nothing is stored; every fault names its case, and its line in NDJSON and CSV. A JSON array that is not JSON is `400`; a line that is not JSON is a faulty case.
#[utoipa::path(
    post,
    path = "/v1/batches",
    tag = "batches",
    operation_id = "submit_batch",
    params(BatchQuery, NamedQuery, SubmitParameters),
    request_body(content(
        (Cases = "application/json"),
        (String = "application/x-ndjson"),
        (String = "text/csv"),
        (Vec<u8> = "application/vnd.apache.arrow.stream"),
        (Vec<u8> = "application/vnd.apache.parquet"),
        (Vec<u8> = "application/x-npz"),
        (TableUpload = "multipart/form-data")
    ), description = "Cases, at most 200 000, each of at most 8 MiB and together at most 1 GiB"),
    responses(BatchAccepted, BatchProblems)
)]
pub(crate) async fn submit(
    Submission {
        jobs,
        own: (own, named),
        options: submit_options,
        idempotency_key,
        reply,
    }: Submission<(BatchQuery, NamedQuery)>,
    State(options): State<HttpOptions>,
    State(memory): State<Memory>,
    request: Request,
) -> Result<Response, ApiError> {
    let (name, labels) = named.read_for(&jobs)?;
    let (request, template) =
        separate_template(&jobs, &memory, &options, own.template, request).await?;
    let (form, template_share) = form(&jobs, request.headers(), template).await?;
    let mut draft = read_draft(&jobs, &memory, &options, form, request).await?;
    drop(template_share);
    draft.options = submit_options;
    draft.name = name;
    draft.labels = labels;
    if draft.cases == draft.rejected || (draft.rejected > 0 && !own.on_invalid.unwrap_or(false)) {
        return Err(refusal(&draft));
    }
    let errors = faults(&draft);
    let (batch, replayed) = jobs.submit_batch(draft, idempotency_key).await?;
    reply
        .send(&jobs, &memory, (batch.into(), replayed), Some(errors))
        .await
}

/// Why a batch is not taken.
fn refusal(draft: &BatchUpload) -> ApiError {
    if draft.cases == 0 {
        return ApiError::new(ProblemKind::FaultyBatch, "the batch has no case");
    }
    let kept = draft.faulty.len();
    let more = match draft.rejected as usize - kept {
        0 => String::new(),
        _ => format!("; the faults of the first {kept} of them are listed"),
    };
    ApiError::listing(
        ProblemKind::FaultyBatch,
        format!(
            "{} of {} cases have faults, so nothing was stored{more}",
            draft.rejected, draft.cases
        ),
        faults(draft),
    )
}

fn faults(draft: &BatchUpload) -> Vec<Fault> {
    let cases = draft.faulty.iter();
    let faults = cases.flat_map(|case| {
        case.faults.iter().map(|fault| Fault {
            pointer: Some(format!("/{}{}", case.index, fault.pointer)),
            line: case.line,
            ..Fault::from(fault.clone())
        })
    });
    faults.collect()
}
