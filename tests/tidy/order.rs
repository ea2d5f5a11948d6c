//! The order of the rooms and of what is in them, and the door of `contact`.

/// Modules in the order in which they may use each other: each only those before it and its own kind. The longest entry that fits a module
/// counts; an entry for a whole room fits its page only.
const ORDER: &[&str] = &[
    "contact::mesh",
    "contact::zones",
    "contact::remark",
    "contact::geometry",
    "contact::case",
    "contact::monitor",
    "contact::error",
    "contact::influence",
    "contact::normal",
    "contact::solution",
    "contact::problem",
    "contact::tangential",
    "contact::outputs",
    "contact::profile_trust",
    "contact::profiles",
    "contact::slices",
    "contact::read",
    "contact",
    "jobs::clock",
    "jobs::fields",
    "jobs::gate",
    "jobs::idempotency",
    "jobs::recipe",
    "jobs::spool",
    "jobs::watch",
    "jobs::job",
    "jobs::error",
    "jobs::staging",
    "jobs::store",
    "jobs::results",
    "jobs::sweep",
    "jobs::batch",
    "jobs::keys",
    "jobs::leaps",
    "jobs::metrics",
    "jobs::retention",
    "jobs::solver_thread",
    "jobs::storage",
    "jobs::underway",
    "jobs::wishes",
    "jobs::submit",
    "jobs::trace",
    "jobs::turns",
    "jobs::keeper",
    "jobs::attempt",
    "jobs::worker",
    "jobs::housekeeping",
    "jobs::lifecycle",
    "jobs::template",
    "jobs::settle",
    "jobs::reuse",
    "jobs::follow",
    "jobs::fetch",
    "jobs::draft",
    "jobs::backup",
    "jobs",
    "http::options",
    "http::problem::kinds",
    "http::dto::problem",
    "http::problem",
    "http::dto",
    "http::limits",
    "http::render",
    "http::server",
    "http::extract::query",
    "http::extract::accept",
    "http::layers",
    "http::extract",
    "http::state",
    "http::routes",
    "http::contract",
    "http",
    "telemetry",
    "cli::stop",
    "cli::worker_args",
    "cli::http_args",
    "cli::commands",
    "cli::solve",
    "cli::serve",
    "cli::keys",
    "cli::healthcheck",
    "cli::config",
    "cli::backup",
    "cli",
    "",
];

/// What the rooms above `contact` may name of it, and what is in it; of the page itself only what it declares.
pub const DOOR: &[&str] = &[
    "contact",
    "contact::case",
    "contact::error",
    "contact::monitor",
    "contact::outputs",
    "contact::problem",
    "contact::remark",
    "contact::slices",
    "contact::solution",
    "contact::zones",
];

/// The place of a module in the order; nothing if it has none.
pub fn place(module: &str) -> Option<usize> {
    let fits = |entry: &&&str| {
        module == **entry
            || entry.contains("::")
                && module
                    .strip_prefix(**entry)
                    .is_some_and(|rest| rest.starts_with("::"))
    };
    let entry = ORDER.iter().filter(fits).max_by_key(|entry| entry.len())?;
    ORDER.iter().position(|other| other == entry)
}
