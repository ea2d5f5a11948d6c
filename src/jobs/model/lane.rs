//! The lane of a tenant in which the chunks of its runs are queued, beside its jobs: a name that no tenant can have.

use std::sync::Arc;

/// What follows the name of the tenant; no name has a slash.
const ROWS: &str = "/rows";

/// The lane for the rows of a tenant.
#[must_use]
pub fn rows_lane(tenant: &str) -> Arc<str> {
    Arc::from(format!("{tenant}{ROWS}"))
}

/// The tenant whose lane this is, whether for jobs or for rows.
#[must_use]
pub fn tenant_of(lane: &str) -> &str {
    lane.strip_suffix(ROWS).unwrap_or(lane)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_lanes_are_of_one_tenant() {
        assert_eq!(tenant_of(&rows_lane("acme")), "acme");
        assert_eq!(tenant_of("acme"), "acme");
    }
}
