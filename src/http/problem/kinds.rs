//! The kinds of problems, one line each: name, status, slug, title, meaning; the only place that knows status codes of failures.

/// Declares the kinds of problems once: name, status, slug, title, meaning.
macro_rules! kinds {
    ($($kind:ident $status:literal $slug:literal $title:literal $meaning:literal)*) => {
        /// A kind of problem; its slug is the last part of the problem's `type`.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum ProblemKind { $(#[doc = $meaning] $kind,)* }

        impl ProblemKind {
            /// Every kind there is.
            pub const ALL: &[ProblemKind] = &[$(ProblemKind::$kind),*];

            /// The last part of the problem's `type`.
            #[must_use]
            pub fn slug(self) -> &'static str { match self { $(ProblemKind::$kind => $slug),* } }

            /// The problem's `title`.
            #[must_use]
            pub fn title(self) -> &'static str { match self { $(ProblemKind::$kind => $title),* } }

            /// What this kind means and what to do about it.
            #[must_use]
            pub fn meaning(self) -> &'static str { match self { $(ProblemKind::$kind => $meaning),* } }

            /// The status code that goes with it.
            #[must_use]
            pub fn status(self) -> u16 { match self { $(ProblemKind::$kind => $status),* } }
        }
    };
}

kinds! {
    MalformedJson 400 "malformed-json" "The body is not JSON" "The body could not be parsed as JSON; `line` and `column` say where. Members written twice and numbers too large for a 64-bit float count as malformed."
    BadQuery 400 "bad-query" "The query is not understood" "A query parameter is unknown, repeated or has a value that is not allowed; `errors` names every such parameter."
    BadHeader 400 "bad-header" "A header is not understood" "A request header has a value that is not allowed; `errors` names it."
    UnreadableBody 400 "unreadable-body" "The body could not be read" "The connection ended or broke before the whole body had arrived."
    Unauthorized 401 "unauthorized" "A key is needed" "The service is asked with `Authorization: Bearer` and an API key; there was none, or it is unknown or revoked. Keys come from the operator of the service."
    Forbidden 403 "forbidden" "This key may not do that" "The key is good, but it may only read, or it is bound to labels and this concerns the whole tenant, or only the tenant `operator` may do this."
    CrossSite 403 "cross-site" "A foreign page may not change anything" "Without a key nothing is changed on behalf of a web page of another origin; the operator names origins that may with `--cors-origin`."
    HostNotAllowed 403 "host-not-allowed" "The service has another name" "Without a key the service is asked by an address, as `localhost`, or by a name that its operator gave with `--allowed-host`; `Host` was another."
    UnknownRoute 404 "unknown-route" "There is nothing at this address" "The path names no resource of this service; `/openapi.json` lists all of them."
    JobNotFound 404 "job-not-found" "There is no such job" "No job has this id; it was never made here, or it was deleted."
    BatchNotFound 404 "batch-not-found" "There is no such batch" "No batch has this id; it was never made here, or it was deleted."
    RunNotFound 404 "run-not-found" "There is no such run" "No run has this id; it was never made here, or it was deleted."
    RowNotFound 404 "row-not-found" "There is no such row" "The run has no row of this number; rows are counted from 0 in the order in which they were sent."
    ProfileNotFound 404 "profile-not-found" "There is no such profile" "No profile of the tenant has this digest; it was never kept here, or it was deleted."
    OutputNotAsked 404 "output-not-asked" "This output was not asked for" "The case did not ask for this output, so it was not computed; submit the case again with the output named in `outputs`."
    MethodNotAllowed 405 "method-not-allowed" "This method is not allowed here" "The resource exists, but not for this HTTP method; the header `Allow` lists those it has."
    NotAcceptable 406 "not-acceptable" "This form cannot be answered" "The header `Accept` excludes every form in which this resource can be answered, or `format` names another; the detail names them. Most answer `application/json` only."
    BodyTimeout 408 "body-timeout" "The body came too slowly" "The whole body did not arrive within the allowed time (60 s for one case), or a batch came at less than 1024 bytes per second."
    ResultNotReady 409 "result-not-ready" "The job has not ended" "The job is queued or running, so there is no result yet; ask again after `Retry-After` seconds, or submit with `Prefer: wait=N`."
    JobFailed 409 "job-failed" "The job failed" "The job ended without a result; the member `error` of the job says why."
    JobCancelled 409 "job-cancelled" "The job was cancelled" "The job was cancelled before it had a result."
    JobNotEnded 409 "job-not-ended" "The job has not ended" "Only an ended job can be deleted; cancel it first."
    BatchNotEnded 409 "batch-not-ended" "The batch has not ended" "Only a batch of which every job has ended can be deleted; cancel it first."
    RunNotEnded 409 "run-not-ended" "The run has not ended" "Only a run of which every row is over can be deleted; cancel it first."
    Expired 410 "expired" "This has expired" "The job or batch was here, but ended longer ago than this service keeps ended jobs (`expires_at` of a job says until when); it was removed with its results. Its id is remembered for 30 days."
    BodyTooLarge 413 "body-too-large" "The body is too large" "The body exceeds the size that this service accepts for one case, or for a batch; a batch has too many cases, or its rows take longer to read or to evaluate than one request may."
    UnsupportedMediaType 415 "unsupported-media-type" "The body is not declared as JSON" "A case is sent with `Content-Type: application/json`, a batch also with `application/x-ndjson`."
    UnsupportedEncoding 415 "unsupported-encoding" "The body is packed in a way that is not understood" "A body may be sent with `Content-Encoding: gzip` or `zstd`, one of them, or as it is; `Accept-Encoding` of the answer names them."
    FaultyCase 422 "faulty-case" "The case has faults" "The body is JSON but not a case that can be solved; `errors` names every fault by its JSON pointer, with the value given and what is allowed."
    FaultyBatch 422 "faulty-batch" "The batch has faults" "The body holds no cases, or some of them have faults: `errors` names every fault by a JSON pointer that begins with the place of its case (counted from 0), and by its line in NDJSON. Nothing was stored; with `?on_invalid=skip` the good cases are taken."
    FaultyTable 422 "faulty-table" "The header of the table has faults" "The first line of a table names its columns by JSON pointers such as `/load/normal_force_n`, by short names or by quantities with their units; the detail names the column, what it may mean and what is allowed. With `errors` there is one for each faulty column."
    TooManyRequests 429 "too-many-requests" "Too many requests" "The key, or without one the address, sends more requests per second than it may, or the tenant has as many requests, streams or waits under way as it may; the detail says which. Try again after `Retry-After` seconds."
    QuotaExceeded 429 "quota-exceeded" "Too many jobs are waiting" "The tenant has as many queued jobs as it may; nothing was stored, try again after `Retry-After` seconds."
    StoredQuotaExceeded 507 "stored-quota-exceeded" "The tenant has stored as much as it may" "The cases, templates and results of the tenant take as many bytes as they may; nothing was stored, and nothing stored is removed. Delete ended jobs, batches or runs, then send it again."
    ProfilesFull 429 "profiles-full" "No more profiles are kept" "The profiles of the tenant take as many bytes as they may; delete some, then send it again."
    EvaluationTooLong 422 "evaluation-too-long" "The rows take too long to answer at once" "The rows need the solver, and more time, memory or rows than one evaluation may take; the detail says which. Nothing was stored. Submit them to `/v1/runs`, which takes the same body and any number of rows, or one case to `/v1/jobs`."
    IdempotencyConflict 422 "idempotency-conflict" "The idempotency key belongs to another case" "The `Idempotency-Key` was used before with a different body, priority, deadline or `no-cache`; use a new key for a new case."
    Internal 500 "internal" "The service failed" "Something went wrong inside the service; its log has the reason under the request id in the header `x-request-id`."
    QueueFull 503 "queue-full" "The queue is full" "The service holds as many unfinished jobs as it may; nothing was stored, try again after `Retry-After` seconds."
    StorageUnwritable 503 "storage-unwritable" "The disk cannot be written" "The disk of the service is read-only or fails, or its job table is locked by another process; nothing was stored, jobs already accepted are kept. Try again after `Retry-After` seconds."
    StorageUnreachable 503 "storage-unreachable" "The storage cannot be reached" "The database that the nodes share, or the store of the results, does not answer or takes nothing; nothing was stored, jobs already accepted are kept. Try again after `Retry-After` seconds."
    StorageFull 507 "storage-full" "The disk is full" "The disk of the service has no room for another job; nothing was stored, jobs already accepted are kept. Try again after `Retry-After` seconds."
    Draining 503 "draining" "The service is shutting down" "The service takes no new jobs because it is shutting down; jobs already accepted are kept. Try again after `Retry-After` seconds."
    Overloaded 503 "overloaded" "The service has too much to do" "The memory or the turns for requests of this kind are taken, or every connection has a request under way; nothing was done. Try again after `Retry-After` seconds."
    NotReady 503 "not-ready" "The service is not ready" "The job store cannot be reached at the moment."
    NotConverged 422 "not-converged" "The solver did not converge" "Only inside a job: the iteration ended without meeting its tolerance; `residual` and `iterations` belong to the best iterate, `detail` says what to try."
    Unsolvable 422 "unsolvable" "The contact has no answer" "Only inside a job: the region cannot be meshed or the contact does not exist; the detail says why."
    OutOfTime 422 "out-of-time" "The solve ran out of time" "Only inside a job: the case's `solver.time_limit_s` was used up."
    DeadlinePassed 422 "deadline-passed" "The job came too late" "Only inside a job: `deadline_s` of the submission was over before the job had ended; it was not solved any further."
    SolverPanic 500 "solver-panic" "The solver failed" "Only inside a job: the solver stopped on a defect of its own. Other jobs are not affected."
    WorkerLost 500 "worker-lost" "The workers of this job were lost" "Only inside a job: each worker that took the job ended without an answer, as often as is allowed."
}

impl ProblemKind {
    /// Does it pass with time, so that the answer carries `Retry-After`?
    #[must_use]
    pub fn passes(self) -> bool {
        matches!(
            self,
            ProblemKind::ResultNotReady
                | ProblemKind::TooManyRequests
                | ProblemKind::QuotaExceeded
                | ProblemKind::QueueFull
                | ProblemKind::StorageUnwritable
                | ProblemKind::StorageUnreachable
                | ProblemKind::StorageFull
                | ProblemKind::Draining
                | ProblemKind::Overloaded
                | ProblemKind::NotReady
        )
    }
}
