//! Tests over a long time that several nodes keep their guarantees under all kinds of failures, and measures the cost.
//!
//! `cargo bench --bench soak -- NAME …` needs PostgreSQL's programs and, for `nodes`, SeaweedFS (`weed`) on this machine. The names are: `nodes`
//! (kills, restarts and faults of the object store under load; `jobs=` and `rows=` set the numbers), `clocks` (wrong clocks that change meanwhile;
//! needs libfaketime), `starts` (five simultaneous nodes on databases of every age), `skew` (migration of the tables under load, then replacement of
//! the nodes; `old=` names a program of an earlier version), `queue` (claims with 10⁴ and 10⁶ queued jobs), `snapshot` (claims while an old snapshot
//! is held), `rate` (8 workers), `simulation` (1 to 100 nodes with measured costs), `network` (disconnected hosts; needs root or user namespaces,
//! `ip` and `nft`). Without a name, nothing runs. A violated guarantee ends it with a panic. `--profile dev` uses the build of the tests.

#[path = "../../tests/service/cluster/faketime.rs"]
#[allow(dead_code, reason = "shared with the tests")]
mod faketime;
#[path = "../../tests/service/cluster/faulty_server.rs"]
#[allow(dead_code, reason = "shared with the tests")]
mod faulty_server;
#[path = "../../tests/service/cluster/old_tables.rs"]
#[allow(dead_code, reason = "shared with the tests")]
mod old_tables;
#[path = "../../tests/service/cluster/postgres.rs"]
#[allow(dead_code, reason = "shared with the tests")]
mod postgres;
#[path = "../../tests/service/cluster/seaweed.rs"]
#[allow(dead_code, reason = "shared with the tests")]
mod seaweed;
#[path = "../../tests/service/support.rs"]
#[allow(dead_code, reason = "shared with the tests")]
mod support;

#[path = "../claims.rs"]
mod claims;
mod clocks;
mod cluster;
mod hosts;
#[path = "../machine.rs"]
mod machine;
mod network;
mod nodes;
mod queue;
#[path = "../random.rs"]
#[allow(dead_code, reason = "other benches use more of it")]
mod random;
mod rows;
mod simulation;
mod skew;
mod starts;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test --benches` also runs this program, and then it measures nothing.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return;
    }
    if arguments.iter().any(|name| name == "network") && hosts::moved_into_a_network_of_its_own() {
        return;
    }
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .expect("a runtime");
    let number = |name: &str| {
        let mut values = arguments.iter().filter_map(|one| one.strip_prefix(name));
        values.find_map(|value| value.parse::<usize>().ok())
    };
    println!("| what | measured |\n|---|---|");
    for name in arguments.iter().filter(|name| !name.contains(['-', '='])) {
        match name.as_str() {
            "nodes" => runtime.block_on(nodes::run(
                number("jobs=").unwrap_or(5000),
                number("rows=").unwrap_or(100_000),
            )),
            "clocks" => runtime.block_on(clocks::run()),
            "starts" => runtime.block_on(starts::run()),
            "skew" => {
                let old = arguments.iter().find_map(|one| one.strip_prefix("old="));
                runtime.block_on(skew::run(old.map(str::to_owned)));
            }
            "queue" => runtime.block_on(queue::depth()),
            "snapshot" => runtime.block_on(queue::snapshot()),
            "rate" => runtime.block_on(queue::rate()),
            "simulation" => {
                if let Some(costs) = runtime.block_on(queue::costs()) {
                    simulation::run(costs);
                }
            }
            "network" => runtime.block_on(network::run()),
            _ => panic!("there is no soak named {name}"),
        }
    }
}

/// Returns the command without the variables `RAILHEAD_…` of the environment.
fn without_settings(mut command: std::process::Command) -> std::process::Command {
    for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("RAILHEAD_")) {
        command.env_remove(name);
    }
    command
}

/// Prints a line of the table.
fn row(what: &str, measured: impl std::fmt::Display) {
    println!("| {what} | {measured} |");
}
