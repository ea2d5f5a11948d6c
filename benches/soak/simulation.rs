//! Estimates how many nodes one PostgreSQL can serve. It simulates the events of workers that claim, solve and end, with the measured costs of
//! claims and ends. The waiting times are simulated.
//!
//! The server has some cores that run statements in the order of arrival. A worker claims a group or one chunk, solves it, and ends it. A claim or
//! an end occupies a core for a constant time plus a time for each job. It also takes a round trip, during which the server does other work. Times
//! of solves are uniform within ±25 %.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::random::Random;
use crate::row;

/// Time in µs for which a statement occupies a core of the server, and the time of its round trip.
#[derive(Debug, Clone, Copy)]
pub struct Costs {
    /// Time of a claim and its end, independent of what is claimed.
    pub group_us: f64,
    /// Time for each job of the group.
    pub job_us: f64,
    pub round_trip_us: f64,
}

/// The work: units of a claim, their number, and the time of each.
#[derive(Debug, Clone, Copy)]
struct Work {
    name: &'static str,
    /// Number of units that are claimed and ended together.
    group: usize,
    unit_us: f64,
    /// Number of results of a unit: one job, or the rows of a chunk.
    counts: usize,
}

const WORKS: [Work; 3] = [
    Work {
        name: "jobs of 3 ms, groups of 66 (200 ms)",
        group: 66,
        unit_us: 3_000.0,
        counts: 1,
    },
    Work {
        name: "jobs of 20 ms, groups of 10 (200 ms)",
        group: 10,
        unit_us: 20_000.0,
        counts: 1,
    },
    Work {
        name: "rows of runs of 3 ms, chunks of 1000 (3 s)",
        group: 1,
        unit_us: 3_000_000.0,
        counts: 1000,
    },
];

const NODES: [usize; 6] = [1, 2, 4, 10, 30, 100];
const WORKERS_OF_A_NODE: usize = 16;
const SERVER_CORES: usize = 4;

/// Simulated time in µs. The first tenth is not counted.
const LASTS_US: f64 = 60e6;

/// A point in time, which is never NaN.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
struct At(f64);

impl Eq for At {}

#[expect(clippy::derive_ord_xor_partial_ord, reason = "moments are never NaN")]
impl Ord for At {
    fn cmp(&self, other: &At) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// The result: units per second, and the utilisation of workers and server.
struct Figures {
    per_s: f64,
    workers: f64,
    server: f64,
}

/// Simulates workers. Each asks the server to end its solved group and for the next group.
fn play(work: Work, workers: usize, costs: Costs) -> Figures {
    let mut cores = BinaryHeap::from([Reverse(At(0.0)); SERVER_CORES]);
    let mut random = Random(1);
    let (group, counts) = (work.group as f64, work.counts as f64);
    let solve_us = group * work.unit_us;
    // All workers begin within the time of one solve.
    let mut asks: BinaryHeap<_> = (0..workers)
        .map(|_| Reverse(At(random.part() * solve_us)))
        .collect();
    let asked_us = costs.group_us + group * costs.job_us;
    let (mut units, mut solving, mut serving) = (0.0, 0.0, 0.0);
    while let Some(Reverse(At(now))) = asks.pop() {
        if now > LASTS_US {
            break;
        }
        let Some(Reverse(At(free))) = cores.pop() else {
            break;
        };
        let served = free.max(now) + asked_us;
        cores.push(Reverse(At(served)));
        let solve = solve_us * random.between(0.75, 1.25);
        asks.push(Reverse(At(served + costs.round_trip_us + solve)));
        if now > LASTS_US / 10.0 {
            units += group * counts;
            solving += solve;
            serving += asked_us;
        }
    }
    let counted = 0.9 * LASTS_US;
    let (workers, cores) = (workers as f64, SERVER_CORES as f64);
    Figures {
        per_s: units / (counted * 1e-6),
        workers: solving / (counted * workers),
        server: serving / (counted * cores),
    }
}

/// Simulates 1 to 100 nodes, for small jobs and for chunks of runs.
pub fn run(costs: Costs) {
    row(
        "costs: of a claim with its end, of each job in it, round trips",
        format!(
            "{:.0} µs, {:.0} µs, {:.0} µs; nodes of {WORKERS_OF_A_NODE} workers, a server of {SERVER_CORES} cores",
            costs.group_us, costs.job_us, costs.round_trip_us
        ),
    );
    for work in WORKS {
        for nodes in NODES {
            let played = play(work, nodes * WORKERS_OF_A_NODE, costs);
            row(
                &format!("{}: {nodes} nodes", work.name),
                format!(
                    "{:.0} per second, workers {:.0} % busy, server {:.0} %",
                    played.per_s,
                    100.0 * played.workers,
                    100.0 * played.server
                ),
            );
        }
    }
}
