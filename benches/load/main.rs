//! Measures the service under load against the solver alone on the same machine in the same run.
//!
//! `cargo bench --bench load [-- PART … [workers=N] [jobs=N]]` starts the real program on loopback with a separate data folder and prints a table.
//! Without names, it runs all parts: `mixed` (64 clients for a minute), `soak` (20 000 small jobs, submitted one by one and removed after a while;
//! `jobs=N` sets another number), `batch` (20 000 cases in one request), `crowds` (silent connections, followers, large bodies, unread responses),
//! `claims`, `lists` (filters that match nothing among 200 000 jobs), `mixed-lengths` (a long sweep and short jobs on one worker), `rows`
//! (`/v1/evaluate` and runs of a million rows), `memory` (four workers and mixed cases), `shared` (claims and ends on the PostgreSQL in
//! `RAILHEAD_TEST_POSTGRES`). The driver runs on one thread of the same machine. A violated guarantee (a wrong answer, a lost or duplicated job)
//! ends it with a panic. Missed goals are printed.

#[path = "../machine.rs"]
mod machine;

mod batch;
mod cases;
#[path = "../claims.rs"]
mod claims;
#[path = "../client.rs"]
mod client;
mod crowds;
mod lengths;
mod memory;
mod mixed;
#[path = "../random.rs"]
#[allow(dead_code, reason = "other benches use more of it")]
mod random;
mod rows;
#[path = "../service.rs"]
#[allow(dead_code, reason = "other benches use the rest")]
mod service;
mod shared;
mod soak;
mod table;

use machine::quantile;

/// Names of the parts.
const PARTS: [&str; 10] = [
    "mixed",
    "soak",
    "batch",
    "crowds",
    "claims",
    "lists",
    "mixed-lengths",
    "rows",
    "memory",
    "shared",
];

/// One line of the table: the quantity, the figure, and the goal if there is one.
pub struct Row(pub String, pub String, pub String);

impl Row {
    /// Returns a figure with a goal that it meets or misses.
    pub fn judged(what: &str, figure: String, goal: &str, met: bool) -> Row {
        let verdict = if met { "met" } else { "MISSED" };
        Row(what.to_owned(), figure, format!("{goal}: {verdict}"))
    }

    /// Returns a figure without a goal.
    pub fn plain(what: &str, figure: String) -> Row {
        Row(what.to_owned(), figure, String::new())
    }
}

/// Returns the median and the 99 % quantile of times in s, as a text in ms.
fn times(seconds: &[f64]) -> String {
    let [median, p99] = [0.5, 0.99].map(|share| 1e3 * quantile(seconds.to_vec(), share));
    format!("{median:.2}, {p99:.2} ms")
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test --benches` also runs this program, and then it measures nothing.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return;
    }
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let number = |name: &str| {
        let mut values = arguments.iter().filter_map(|one| one.strip_prefix(name));
        values.find_map(|value| value.parse::<usize>().ok())
    };
    // The default of the service.
    let workers = number("workers=").unwrap_or((cores - 1).max(1));
    let jobs = number("jobs=").unwrap_or(20_000);
    let named = |part: &str| arguments.iter().any(|argument| argument == part);
    let all = !PARTS.into_iter().any(named);
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .expect("a runtime");
    println!("{cores} cores, {workers} worker(s), driver on one thread of the same machine\n");
    println!("| what | measured | goal |\n|---|---|---|");
    for part in PARTS.into_iter().filter(|part| all || named(part)) {
        let rows = runtime.block_on(async {
            match part {
                "mixed" => mixed::run(workers).await,
                "soak" => soak::run(workers, jobs).await,
                "batch" => batch::run(workers).await,
                "crowds" => crowds::run(workers).await,
                "claims" => table::claims().await,
                "lists" => table::lists().await,
                "mixed-lengths" => lengths::run().await,
                "rows" => rows::run(workers).await,
                "memory" => memory::run().await,
                _ => shared::ends().await,
            }
        });
        for Row(what, figure, goal) in rows {
            println!("| {what} | {figure} | {goal} |");
        }
    }
}
