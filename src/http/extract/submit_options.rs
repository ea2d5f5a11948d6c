//! `?priority=` and `?deadline_s=`, and `Cache-Control: no-cache`: what may be wished for jobs at their submission.

use std::time::Duration;

use axum::http::{HeaderMap, header};

use crate::http::extract::query::{Query, whole};
use crate::jobs::wishes::{Priority, Wishes};

/// The parameters read here.
pub const PARAMETERS: [&str; 2] = ["priority", "deadline_s"];

/// Longest deadline in s: 30 days.
const DEADLINE_MAX_SECONDS: u32 = 30 * 24 * 3600;

/// Reads the wishes; faults of the query are told by its end.
pub fn take_wishes(query: &mut Query, headers: &HeaderMap) -> Wishes {
    let priority = query.take(
        "priority",
        &Priority::ALL.map(Priority::name).join(", "),
        Priority::from_name,
    );
    let seconds = query.take(
        "deadline_s",
        "a whole number of seconds from 1 to 2592000",
        |text| whole(text, 1, DEADLINE_MAX_SECONDS),
    );
    Wishes {
        priority: priority.unwrap_or_default(),
        ends_within: seconds.map(|seconds| Duration::from_secs(seconds.into())),
        fresh: wants_fresh(headers),
    }
}

/// Does the client refuse results of earlier identical cases?
fn wants_fresh(headers: &HeaderMap) -> bool {
    let values = headers.get_all(header::CACHE_CONTROL);
    let mut directives = values
        .iter()
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(','));
    directives.any(|directive| directive.trim().eq_ignore_ascii_case("no-cache"))
}
