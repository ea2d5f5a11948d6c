//! `?priority=`, `?deadline_s=` and `Cache-Control: no-cache`: the options of a submission.

use std::time::Duration;

use axum::http::{HeaderMap, header};

use crate::http::extract::query::{query, reader, seconds};
use crate::jobs::model::submit_options::{Priority, SubmitOptions};

/// Longest deadline in s: 30 days.
pub const DEADLINE_MAX_SECONDS: u32 = 30 * 24 * 3600;

query! {
    /// Options of a submission.
    SubmitQuery(() => ()) {
        /// Which of the queued jobs of the tenant are solved first: `high` before `normal` (when left out) before `low`. Tenants take turns whatever the priorities of their jobs
        #[param(example = "high")]
        priority: Priority as Priority = reader(Priority::ALL.map(Priority::name).join(", "), Priority::from_name);
        /// Seconds from now within which a job must have ended. One that has not, queued or running, fails as `deadline-passed`
        #[param(minimum = 1, maximum = 2_592_000, example = 600)]
        deadline_s: u32 as u32 = seconds(1, DEADLINE_MAX_SECONDS);
    }
}

impl SubmitQuery {
    /// The options of a submission with these headers.
    #[must_use]
    pub(crate) fn options(self, headers: &HeaderMap) -> SubmitOptions {
        SubmitOptions {
            priority: self.priority.unwrap_or_default(),
            ends_within: self
                .deadline_s
                .map(|seconds| Duration::from_secs(seconds.into())),
            bypass_cache: wants_fresh(headers),
        }
    }
}

/// Does the client refuse the result of an earlier identical case?
fn wants_fresh(headers: &HeaderMap) -> bool {
    let values = headers.get_all(header::CACHE_CONTROL);
    let mut directives = values
        .iter()
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(','));
    directives.any(|directive| directive.trim().eq_ignore_ascii_case("no-cache"))
}
